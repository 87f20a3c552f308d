"""A Dask cluster as a place for the workers: the optional part of a benchmark."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from cdfctl.errors import InputError, MissingError

PATIENCE = 5.0
"""Seconds to wait for a scheduler, and for its first worker."""


@contextmanager
def connect(address: str) -> Iterator[Any]:
    """A client of the scheduler at ``tcp://host:port`` with at least one worker.

    Raises:
        InputError: that is not such an address.
        MissingError: Dask is not installed, nobody listens there, or the scheduler has no workers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise MissingError(
            "--dask needs Dask, which is not installed", "python -m pip install 'cdfctl[cluster]'"
        ) from None
    scheme, separator, place = address.partition("://")
    host, _, port = place.rpartition(":")
    if scheme not in ("tcp", "tls") or not separator or not host or not port.isdecimal():
        raise InputError(f"--dask {address}: not the address of a scheduler", "it looks like tcp://host:8786")
    try:
        make: Any = Client  # untyped
        client = make(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError):
        raise MissingError(
            f"no Dask scheduler answers at {address} within {PATIENCE:g} s",
            "start one with: dask scheduler; and workers with: dask worker ADDRESS",
        ) from None
    try:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise MissingError(
                f"the scheduler at {address} has no workers", f"start some with: dask worker {address} --nthreads 1"
            ) from None
        yield client
    finally:
        client.close(timeout=PATIENCE)
