"""The compiler of the kernel: ``njit``, so that every function is compiled the same way.

- ``fastmath`` is off: distances must agree with another implementation to 1e-9, and NaN and infinity are meant.
- ``error_model="numpy"``: a division by zero gives infinity instead of a branch to an exception.
- ``_nrt`` is off: compiled code has no memory manager. Nothing can allocate (an attempt is an error of the compiler),
  and passing arrays about does not count references, which here cost five times the work itself.
- Machine code is kept under the cache place of cdfctl, in a folder named after the text of all kernel sources.
  Numba looks only at the file of the cached function itself, so without that name a change in ``vec.py`` would leave
  an old ``gjk.py``, with the old ``vec.py`` inlined, in use. Where the cache cannot be written, functions are compiled
  afresh in every process.
"""

from __future__ import annotations

import contextlib
import hashlib
import platform
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba

from cdfctl.cache import cache_dir, dir_of_this_version

P = ParamSpec("P")
T = TypeVar("T")

OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": False,
    "boundscheck": False,
    "_nrt": False,
}


def njit(function: Callable[P, T]) -> Callable[P, T]:
    """``numba.njit`` with the options of this package; the types of ``function`` are kept."""
    return _compiled(function, forceinline=False)


def njit_inline(function: Callable[P, T]) -> Callable[P, T]:
    """As :func:`njit`, for what the inner loops of GJK call: the body is put in place of the call.

    A call passes its sets as some thirty numbers on the stack, which takes longer than finding a support point.
    """
    return _compiled(function, forceinline=True)


def _compiled(function: Callable[P, T], forceinline: bool) -> Callable[P, T]:
    config: Any = numba.config
    if config.DISABLE_JIT:  # a debugger or a coverage run wants plain Python
        return function
    return cast(Callable[P, T], _plain_integers(compiled_in(_kernel_cache(), function, forceinline)))


def compiled_in(folder: Path | None, function: Callable[..., Any], forceinline: bool) -> Any:
    """``function``, to be compiled with :data:`OPTIONS` and kept in ``folder``, or in no place where there is none."""
    config: Any = numba.config
    # Numba reads its cache folder once, when a function is decorated: lend it ours for that moment only, so that the
    # caches of other packages in the process stay where they are.
    theirs = config.CACHE_DIR
    config.CACHE_DIR = str(folder or theirs)
    try:
        dispatcher: Any = numba.njit(cache=folder is not None, forceinline=forceinline, **OPTIONS)(function)
    finally:
        config.CACHE_DIR = theirs
    if folder is not None:
        _forgive(dispatcher._cache)
    return dispatcher


def _forgive(kept: Any) -> None:
    """Compile afresh what cannot be read back, and go on where it cannot be kept.

    A disk that was full, or that lost its power, leaves files that are empty or cut short; numba would end with what
    ``pickle`` says of them, at every start.
    """
    load, save = kept.load_overload, kept.save_overload

    def load_or_none(*arguments: Any) -> Any:
        try:
            return load(*arguments)
        except Exception:  # whatever a damaged pickle leads to
            with contextlib.suppress(OSError):
                kept.flush()
            return None

    def save_or_not(*arguments: Any) -> None:
        with contextlib.suppress(OSError):
            save(*arguments)

    kept.load_overload, kept.save_overload = load_or_none, save_or_not


def digest_of(*folders: Path) -> str:
    """A name for what is compiled from the sources in ``folders``: another text, another name."""
    digest = hashlib.sha256(f"{numba.__version__} {platform.python_version()}".encode())
    for folder in folders:
        for source in sorted(folder.glob("*.py")):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _plain_integers(compiled: Any) -> Any:
    """``f(x, 0)`` and ``f(x, 1)`` in compiled code use one ``f`` for all integers, not one for each constant."""
    template = compiled.get_call_template
    unliteral: Any = numba.types.unliteral

    def without_constants(args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        return template(tuple(unliteral(a) for a in args), {name: unliteral(a) for name, a in kws.items()})

    compiled.get_call_template = without_constants
    return compiled


@cache
def _kernel_cache() -> Path | None:
    """The folder of the machine code of these sources. Those of other sources go, but for the last few used."""
    return dir_of_this_version(cache_dir() / "kernels" / digest_of(Path(__file__).parent), "[0-9a-f]" * 16)
