"""Build a table: contacts at every point of a grid, chunk by chunk, in threads.

The compiled search holds no lock of the interpreter, so threads share the work. What a point gives depends on the seed
and on the point alone: the number of threads, the order and an interrupt change nothing.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cdfctl import __version__
from cdfctl.errors import InputError
from cdfctl.fields.kernel.body import Body, body_of
from cdfctl.fields.kernel.starts import Table
from cdfctl.fields.table.contacts import Tools, all_contacts, new_tools
from cdfctl.fields.table.grid import Grid, sampling_limits, workspace_grid
from cdfctl.fields.table.partial import PartialBuild
from cdfctl.robots.robot import Robot
from cdfctl.types import Array

CHUNK = 64  # points: about half a second, the most that an interrupt loses
MOST = 20  # entries a piece and point
# Entries at which another piece is in penetration stay: an entry is a start only, the search goes on with the piece
# that touches, and without them (13 % of a Franka's) queries were measured to be no better.
KEEP_CLEAR = False

Device = Literal["numpy", "cpu", "cuda"]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class BuildParameters:
    """What a table is built with.

    Attributes:
        resolution: grid points along the longest side of the workspace.
        starts: starts tried for each point and piece, at most.
        radius: of the ball, m.
        seed: of the random starts.
        device: ``numpy``: random starts as they are; ``cpu`` or ``cuda``: moved near contact by torch first.
    """

    resolution: int = 22
    starts: int = 96
    radius: float = 0.05
    seed: int = 0
    device: Device = "numpy"

    def __post_init__(self) -> None:
        for name, least, most in (("resolution", 2, 100), ("starts", 3, 100_000), ("seed", 0, 2**63)):
            if not least <= getattr(self, name) <= most:
                raise InputError(f"{name} must be {least} to {most}, found {getattr(self, name)}")
        if not (np.isfinite(self.radius) and 0.0 < self.radius <= 1.0):
            raise InputError(f"radius must be greater than 0 and at most 1 m, found {self.radius}")

    def document(self) -> dict[str, Any]:
        """The parameters as one JSON object."""
        return asdict(self)


def build_table(
    robot: Robot,
    parameters: BuildParameters,
    target: Path,
    *,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Table:
    """The table of ``robot``. Chunks that are done are kept beside ``target`` until :func:`forget_chunks`.

    Args:
        robot: the robot.
        parameters: see there.
        target: where the table will be written, not by this function.
        jobs: threads, every core without it.
        progress: called with the points done and the number of points.

    Raises:
        InputError: the folder of chunks cannot be written, or another process is building the same table.
        MissingError: ``parameters.device`` needs torch or a GPU, and there is none.
        KeyboardInterrupt: passed on once the chunks under way are written.
    """
    body = body_of(robot)
    grid = workspace_grid(body, parameters.resolution, parameters.radius)
    points = grid.points()
    firsts = range(0, len(points), CHUNK)
    make_starts = _starts_of(robot, body, parameters)
    workspace = threading.local()

    def chunk(first: int) -> dict[str, NDArray[Any]]:
        if not hasattr(workspace, "tools"):
            workspace.tools = new_tools(body, parameters.radius, parameters.starts)
        return chunk_contacts(body, points[first : first + CHUNK], make_starts(first, points), workspace.tools)

    with PartialBuild(target, _key(robot, parameters)) as partial:
        kept = {i: partial.read(i) for i in range(len(firsts))}
        done = {
            i: arrays
            for i, arrays in kept.items()
            if arrays is not None and _is_chunk(arrays, len(points[firsts[i] : firsts[i] + CHUNK]), body)
        }
        _report(progress, done, points)
        missing = [i for i in range(len(firsts)) if i not in done]
        pool = ThreadPoolExecutor(jobs or os.cpu_count() or 1)
        running: dict[Future[dict[str, NDArray[Any]]], int] = {}
        try:
            running = {pool.submit(chunk, firsts[i]): i for i in missing}
            waiting = set(running)
            while waiting:
                finished, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in finished:
                    done[running[future]] = future.result()
                    partial.write(running[future], done[running[future]])
                _report(progress, done, points)
        finally:
            # After an interrupt: no new chunks, but those under way are kept.
            pool.shutdown(cancel_futures=True)
            for future, i in running.items():
                if i not in done and future.done() and not future.cancelled() and future.exception() is None:
                    partial.write(i, future.result())
    return assemble_table(grid, [done[i] for i in range(len(firsts))])


def forget_chunks(target: Path) -> None:
    """Remove what :func:`build_table` keeps beside ``target``: the table is written."""
    PartialBuild(target, {}).remove()


def _key(robot: Robot, parameters: BuildParameters) -> dict[str, Any]:
    return {"version": __version__, "robot": robot.hash, "chunk": CHUNK, "most": MOST, **parameters.document()}


def _report(progress: Progress | None, done: dict[int, Any], points: Array) -> None:
    if progress is not None:
        progress(min(len(done) * CHUNK, len(points)), len(points))


def _starts_of(robot: Robot, body: Body, parameters: BuildParameters) -> Callable[[int, Array], Array]:
    """The starts (p, k, s, n) of the chunk whose first point is given: drawn, and moved near contact where asked."""
    if parameters.device != "numpy":
        from cdfctl.fields.table.proposals import Proposer

        pieces = tuple(sorted(robot.pieces, key=lambda piece: piece.link))  # the order of the kernel
        proposer = Proposer(body, pieces, parameters.radius, parameters.device)

    def make(first: int, points: Array) -> Array:
        count = min(CHUNK, len(points) - first)
        starts = np.stack([random_starts(body, parameters.seed, first + i, parameters.starts) for i in range(count)])
        return starts if parameters.device == "numpy" else proposer.near_contact(points[first : first + count], starts)

    return make


def random_starts(body: Body, seed: int, point: int, starts: int) -> Array:
    """(k, s, n) configurations, drawn evenly within the limits, of one point; no other point has the same."""
    lower, upper = sampling_limits(body)
    draws = np.random.default_rng([seed, point]).random((len(body.joint), starts, len(lower)))
    configurations: Array = lower + (upper - lower) * draws
    return configurations


def chunk_contacts(body: Body, points: Array, starts: Array, tools: Tools) -> dict[str, NDArray[Any]]:
    """Entries of ``points`` (p, 3): ``count`` (p, k) of each point and piece, ``q`` (e, n) one after another."""
    pieces, n = len(body.joint), starts.shape[-1]
    count = np.zeros((len(points), pieces), dtype=np.int64)
    contacts = np.zeros((len(points), pieces, MOST, n))
    all_contacts(body, np.ascontiguousarray(points), starts, KEEP_CLEAR, tools, count, contacts)
    kept = np.arange(MOST) < count[:, :, None]
    return {"count": count.astype(np.int16), "q": contacts[kept].astype(np.float32)}


def _is_chunk(arrays: dict[str, NDArray[Any]], points: int, body: Body) -> bool:
    """Whether ``arrays``, as a file gave them, are what :func:`chunk_contacts` gives for this many points."""
    if arrays.keys() != {"count", "q"}:
        return False
    count, q = arrays["count"], arrays["q"]
    return (
        count.dtype == np.int16
        and count.shape == (points, len(body.joint))
        and bool(np.all((count >= 0) & (count <= MOST)))
        and q.dtype == np.float32
        and q.shape == (int(count.sum()), len(body.chain.parent))
        and bool(np.isfinite(q).all())
    )


def assemble_table(grid: Grid, chunks: list[dict[str, NDArray[Any]]]) -> Table:
    """The chunks, in order, as one table."""
    count = np.concatenate([c["count"] for c in chunks]).astype(np.int64)
    piece = np.tile(np.arange(count.shape[1], dtype=np.int16), len(count))
    return Table(
        origin=grid.origin,
        spacing=grid.spacing,
        shape=grid.shape,
        first=np.concatenate([[0], np.cumsum(count.sum(axis=1))]).astype(np.int64),
        piece=np.repeat(piece, count.reshape(-1)),
        q=np.concatenate([c["q"] for c in chunks]),
    )
