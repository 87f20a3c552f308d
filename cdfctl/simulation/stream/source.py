"""Lines from outside, as far as they have come: nothing here ever waits."""

from __future__ import annotations

import os
import select
import socket
import sys
from typing import Protocol

from cdfctl.errors import InputError
from cdfctl.scenario.feed import FeedConfig

MAX_LINE = 65536
"""Longest line, bytes; what is longer is garbage."""

MAX_READ = 1 << 20
"""Most bytes taken at one control step: a flood must not hold the loop up."""


class Source(Protocol):
    """Where lines come from."""

    def lines(self) -> list[bytes]:
        """The whole lines that have come since the last call."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class UdpSource:
    """Datagrams to a UDP port, each of one line or more."""

    def __init__(self, host: str, port: int) -> None:
        """Listen. Raises :class:`InputError` where that cannot be."""
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind, protocol)
            try:
                self._socket.setblocking(False)
                self._socket.bind(address)
            except OSError:
                self._socket.close()
                raise
        except OSError as error:
            raise InputError(f"obstacles: cannot listen at {host}:{port}: {error.strerror or error}") from None

    def lines(self) -> list[bytes]:
        """The lines of all datagrams that have come."""
        found: list[bytes] = []
        taken = 0
        while taken < MAX_READ:
            try:
                datagram = self._socket.recv(MAX_LINE)
            except BlockingIOError:
                break
            except OSError:
                continue  # an error of some sender's network, told to us: there may be more to read
            taken += len(datagram) + 1
            found += [line for line in datagram.split(b"\n") if line.strip()]
        return found

    def close(self) -> None:
        """Stop listening."""
        self._socket.close()


class StdinSource:
    """Standard input, or any other open file descriptor."""

    def __init__(self, descriptor: int | None = None) -> None:
        self._descriptor = sys.stdin.fileno() if descriptor is None else descriptor
        self._rest = b""
        self._ended = False

    def lines(self) -> list[bytes]:
        """The whole lines that have come; what stands after the last newline waits for its end."""
        taken = 0
        while not self._ended and taken < MAX_READ and select.select([self._descriptor], [], [], 0.0)[0]:
            chunk = os.read(self._descriptor, MAX_LINE)
            self._ended = not chunk
            self._rest += chunk
            taken += len(chunk)
        *whole, self._rest = self._rest.split(b"\n")
        if len(self._rest) > MAX_LINE:
            whole, self._rest = [*whole, self._rest], b""
        return [line for line in whole if line.strip()]

    def close(self) -> None:
        """Standard input is not ours to close."""


def source_of(config: FeedConfig) -> Source:
    """The source a scenario names. Raises :class:`InputError` where it cannot be listened to."""
    if config.source == "stdin":
        return StdinSource()
    assert config.port is not None  # the schema asks for it
    return UdpSource(config.host, config.port)
