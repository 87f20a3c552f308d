"""The compiler of the planner: that of :mod:`cdfctl.fields.kernel`, with a cache of its own.

The machine code holds what it calls of the fields' kernels, so the cache is named after the text of both.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba

from cdfctl.cache import cache_dir, dir_of_this_version
from cdfctl.fields.kernel import jit

P = ParamSpec("P")
T = TypeVar("T")


def njit(function: Callable[P, T]) -> Callable[P, T]:
    """``numba.njit`` with the options of the fields' kernels; the types of ``function`` are kept."""
    return _compiled(function, forceinline=False)


def njit_inline(function: Callable[P, T]) -> Callable[P, T]:
    """The same, its body put in place of every call: handing some forty arrays on takes longer than the work here."""
    return _compiled(function, forceinline=True)


def _compiled(function: Callable[P, T], *, forceinline: bool) -> Callable[P, T]:
    config: Any = numba.config
    if config.DISABLE_JIT:  # a debugger or a coverage run wants plain Python
        return function
    return cast(Callable[P, T], jit.compiled_in(_cache(), function, forceinline))


@cache
def _cache() -> Path | None:
    digest = jit.digest_of(Path(jit.__file__).parent, Path(__file__).parent)
    return dir_of_this_version(cache_dir() / "kernels" / f"planner-{digest}", "planner-*")
