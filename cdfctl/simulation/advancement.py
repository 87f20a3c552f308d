"""Conservative advancement over a recorded motion: its least distance, and its first contact.

Between two recorded states the distance of a pair changes at most as fast as ``speed``: on [a, b]

    d >= ( d(a) + d(b) - L (b - a) ) / 2

The least distance follows by halving the intervals whose bound is below the best value seen, until none is lower by
more than ``CLEARANCE_TOLERANCE``. The first contact follows by stepping ahead by d / L, which cannot jump over one.
"""

from __future__ import annotations

import heapq
import math
from abc import ABC, abstractmethod

import numpy as np

from cdfctl.types import Array, Contact

CONTACT = 1e-6  # m: contact is d <= CONTACT
CLEARANCE_TOLERANCE = 1e-4  # m: accuracy of the least clearance


class Advancement(ABC):
    """Pairs of bodies over N recorded intervals.

    Attributes:
        t: (N+1,) times of the recorded states, s.
        at_steps: (N+1, pairs) signed distances at the recorded states, m.
        speed: (N, pairs) bounds on how fast they change in between, m/s.
        best, best_time, best_pair: the least distance evaluated so far (m), when (s), and of which pair.
    """

    t: Array
    at_steps: Array
    speed: Array
    best: float
    best_time: float
    best_pair: int

    @abstractmethod
    def distance_at(self, k: int, pair: int, t: float) -> float:
        """Signed distance of a pair at time ``t`` (s) within interval ``k``, m."""

    @abstractmethod
    def contact_of(self, time: float, pair: int) -> Contact:
        """The contact of a pair at ``time``, by name."""

    def start(self) -> None:
        """Take the best of ``at_steps``."""
        self.best, self.best_time, self.best_pair = math.inf, 0.0, -1
        if self.at_steps.size:
            k, pair = divmod(int(np.argmin(self.at_steps)), self.at_steps.shape[1])
            self._note(float(self.at_steps[k, pair]), float(self.t[k]), pair)

    def search(self) -> Contact | None:
        """Find the least distance, and the first contact if there is one."""
        self.find_least()
        return self.first_contact() if self.best - CLEARANCE_TOLERANCE <= CONTACT else None

    def _bounds(self, k: int) -> Array:
        """Lower bounds (pairs,) of the distances within interval ``k``."""
        bounds: Array = 0.5 * (self.at_steps[k] + self.at_steps[k + 1] - self.speed[k] * (self.t[k + 1] - self.t[k]))
        return bounds

    def _measure(self, k: int, pair: int, t: float) -> float:
        """Distance of a pair at time ``t`` within interval ``k``; the least one is kept."""
        d = self.distance_at(k, pair, t)
        self._note(d, t, pair)
        return d

    def _note(self, distance: float, t: float, pair: int) -> None:
        if distance < self.best:
            self.best, self.best_time, self.best_pair = distance, t, pair

    def find_least(self) -> None:
        """Search between the recorded states until ``best`` is within ``CLEARANCE_TOLERANCE`` of the run's least."""
        heap: list[tuple[float, int, int, float, float, float, float]] = []

        def push(k: int, pair: int, a: float, b: float, d_a: float, d_b: float, speed: float) -> None:
            bound = 0.5 * (d_a + d_b - speed * (b - a))
            if bound < self.best - CLEARANCE_TOLERANCE:
                heapq.heappush(heap, (bound, k, pair, a, b, d_a, d_b))

        for k in range(len(self.t) - 1):
            for pair in np.flatnonzero(self._bounds(k) < self.best - CLEARANCE_TOLERANCE).tolist():
                before, after = float(self.at_steps[k, pair]), float(self.at_steps[k + 1, pair])
                push(k, pair, float(self.t[k]), float(self.t[k + 1]), before, after, float(self.speed[k, pair]))
        while heap and heap[0][0] < self.best - CLEARANCE_TOLERANCE:
            _, k, pair, a, b, d_a, d_b = heapq.heappop(heap)
            middle, speed = 0.5 * (a + b), float(self.speed[k, pair])
            d = self._measure(k, pair, middle)
            push(k, pair, a, middle, d_a, d, speed)
            push(k, pair, middle, b, d, d_b, speed)

    def first_contact(self) -> Contact | None:
        """The first contact of the run: every pair advances by steps of ``d / L``, one interval after the other."""
        for k in range(len(self.t) - 1):
            start, end = float(self.t[k]), float(self.t[k + 1])
            found: tuple[float, int] | None = None
            for pair in np.flatnonzero(self._bounds(k) <= CONTACT).tolist():
                time = self._advance(k, pair, start, end if found is None else found[0])
                if time is not None:
                    found = (time, pair)
            if found is not None:
                return self.contact_of(*found)
        # what is left: contact at the very end, or one that touches by less than CONTACT
        return self.contact_of(self.best_time, self.best_pair) if self.best <= CONTACT else None

    def _advance(self, k: int, pair: int, start: float, end: float) -> float | None:
        """The first contact of a pair in [start, end), None where there is none."""
        t = start
        while t < end:
            d = self._measure(k, pair, t)
            if d <= CONTACT:
                return t
            # at least CONTACT / L, within which a distance above CONTACT cannot fall below zero
            t += max(d - CONTACT, CONTACT) / max(float(self.speed[k, pair]), 1e-12)
        return None
