"""A viser server that keeps quiet: on the port asked for or not at all, with nothing on standard output."""

from __future__ import annotations

import io
import socket
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any

from cdfctl.errors import InputError
from cdfctl.report.view.solids import need_packages

LOOPBACK = "127.0.0.1"
PORT = 8080
"""Where the page is served if nothing else is asked for; the next free one where it is taken."""


@contextmanager
def serving(host: str = LOOPBACK, port: int | None = None) -> Iterator[Any]:
    """A running ``viser.ViserServer``, stopped at the end.

    Args:
        host: the address to listen on.
        port: exactly this port, 0 for any free one; None for :data:`PORT` or the next free one after it.

    Raises:
        InputError: the port is taken, or there is no such address here.
        MissingError: viser is not installed.
    """
    need_packages()
    from viser import ViserServer

    # viser looks for another port without a word, and for ever where the address is wrong.
    _check(host, 0 if port is None else port)
    with redirect_stdout(io.StringIO()):  # it prints a banner, whatever it is told
        server = ViserServer(host=host, port=PORT if port is None else port, verbose=False)
    try:
        yield server
    finally:
        with redirect_stdout(io.StringIO()):
            server.stop()


def _check(host: str, port: int) -> None:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server does
            probe.bind(address)
    except OSError as error:
        where = f"{host}:{port}" if port else host
        hint = "give another --port, or 0 for any free one" if port else "give another --host"
        raise InputError(f"cannot serve on {where}: {error.strerror or error}", hint=hint) from None
