"""Structs of arrays that compiled code takes by address.

A kernel works on some hundred arrays: the robot, the obstacles, the workspaces. Numba passes a tuple of arrays by
value, seven to eleven words an array at every call, compiles all that copying anew in every function, and takes the
tuple apart at every call from Python. A :class:`Struct` is one word: the address of a header that holds, for each
member,

    an array      the address of its numbers, then its shape (it must be contiguous)
    a number      itself
    a struct      the address of its header
    a function    the address of its machine code

Headers are written once, when the struct is made, and never change, so compiled code may read them ahead (LLVM's
``invariant.load``). What the arrays hold may change at will. A struct must outlive the calls it is passed to, and
compiled code cannot make one. As plain Python, with ``NUMBA_DISABLE_JIT``, it is an ordinary frozen dataclass.

That halves the time of the compiler, and the time of a distance in a search.

A function called by its address (see :func:`compiled`) is compiled once. LLVM takes what is called by name into every
caller, and into their callers, and compiles it over and over.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ParamSpec, Self, TypeVar, cast, dataclass_transform

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    unbox,
)
from numba.np.arrayobj import populate_array

P = ParamSpec("P")
T = TypeVar("T")

WORD = ir.IntType(64)


@dataclass_transform(frozen_default=True, eq_default=False)
class Struct:
    """The base of all structs: annotate the members, as in a dataclass."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, eq=False)(cls)

    def __post_init__(self) -> None:
        config: Any = numba.config
        if config.DISABLE_JIT:
            return
        words: list[int] = []
        members: list[tuple[str, types.Type]] = []
        for name, value in self.members().items():
            kind, more = _packed(name, value)
            members.append((name, kind))
            words += more
        header = np.array(words, dtype=np.int64)
        # What numba asks a value for: its type, and below (`_unbox`) where it is.
        object.__setattr__(self, "_numba_type_", _type_of(type(self).__name__, tuple(members)))
        object.__setattr__(self, "_header", header)
        object.__setattr__(self, "_address", header.ctypes.data)

    def members(self) -> dict[str, Any]:
        """The members by name."""
        return {name: getattr(self, name) for name in self.__annotations__}

    def __reduce__(self) -> tuple[type[Self], tuple[Any, ...]]:
        return type(self), tuple(self.members().values())  # a copy has arrays, and so a header, of its own


def _packed(name: str, value: Any) -> tuple[types.Type, list[int]]:
    """The type of a member and its words in the header."""
    if isinstance(value, np.ndarray):
        if not value.flags.c_contiguous:
            raise ValueError(f"{name}: an array in a struct must be contiguous")
        return _array_of(value.dtype, value.ndim), [value.ctypes.data, *value.shape]
    if isinstance(value, Struct):
        return value._numba_type_, [value._address]  # type: ignore[attr-defined] # set by __post_init__
    if isinstance(value, Compiled):
        return value.kind, [value.address]
    if isinstance(value, float):
        return types.float64, list(struct.unpack("q", struct.pack("d", value)))
    raise TypeError(
        f"{name}: a struct holds arrays, floats, structs and compiled functions, not {type(value).__name__}"
    )


@lru_cache(maxsize=64)
def _array_of(dtype: np.dtype[Any], ndim: int) -> types.Array:
    """Numba's own look at an array takes as long as a query does to fill it."""
    return types.Array(numba.from_dtype(dtype), ndim, "C")


@dataclass(frozen=True)
class Compiled:
    """The machine code of a function for arguments of certain types."""

    function: Any
    kind: types.Type
    address: int


def compiled(function: Callable[P, T], *examples: Any) -> Callable[P, T]:
    """A member of a struct through which compiled code calls ``function`` with arguments of the types of ``examples``.

    Compiled code only: Python calls ``function`` itself, which with ``NUMBA_DISABLE_JIT`` is what is returned.
    """
    config: Any = numba.config
    if config.DISABLE_JIT:
        return function
    dispatcher: Any = function
    arguments = tuple(numba.typeof(example) for example in examples)
    dispatcher.compile(arguments)
    result = dispatcher.overloads[arguments]
    address = result.library.get_pointer_to_function(result.fndesc.llvm_func_name)
    return cast(Callable[P, T], Compiled(function, types.FunctionType(result.signature), address))


class StructType(types.Type):
    """The numba type of a struct: its class and the types of its members."""

    def __init__(self, name: str, members: tuple[tuple[str, types.Type], ...]) -> None:
        self.kinds = dict(members)
        self.places: dict[str, int] = {}
        place = 0
        for member, kind in members:
            self.places[member] = place
            place += 1 + kind.ndim if isinstance(kind, types.Array) else 1
        # A short name: it is part of the symbol of every function that takes the struct.
        digest = hashlib.sha256(repr([(m, str(kind)) for m, kind in members]).encode()).hexdigest()[:8]
        super().__init__(f"{name}_{digest}")


@lru_cache(maxsize=256)
def _type_of(name: str, members: tuple[tuple[str, types.Type], ...]) -> StructType:
    return StructType(name, members)


@register_model(StructType)
class _Address(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: StructType) -> None:
        super().__init__(manager, kind, WORD.as_pointer())


@unbox(StructType)
def _unbox(kind: StructType, value: Any, c: Any) -> NativeValue:
    number = c.pyapi.object_getattr_string(value, "_address")
    address = c.builder.bitcast(c.pyapi.long_as_voidptr(number), WORD.as_pointer())
    c.pyapi.decref(number)
    return NativeValue(address)


@infer_getattr
class _Members(AttributeTemplate):
    key = StructType

    def generic_resolve(self, kind: Any, name: str) -> Any:  # type: ignore[override] # numba declares none
        return kind.kinds.get(name)


@lower_getattr_generic(StructType)
def _member(context: Any, builder: Any, kind: StructType, address: Any, name: str) -> Any:
    member, place = kind.kinds[name], kind.places[name]

    def word(offset: int, as_type: Any) -> Any:
        where = builder.gep(address, [ir.Constant(ir.IntType(32), place + offset)])
        value = builder.load(builder.bitcast(where, as_type.as_pointer()))
        value.set_metadata("invariant.load", builder.module.add_metadata([]))
        return value

    if isinstance(member, types.FunctionType):
        function = cgutils.create_struct_proxy(member)(context, builder)
        function.jit_addr = word(0, function.jit_addr.type)
        function.jit_addr.set_metadata("nonnull", builder.module.add_metadata([]))
        return function._getvalue()
    if not isinstance(member, types.Array):
        return word(0, context.get_value_type(member))
    array = context.make_array(member)(context, builder)
    size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(member.dtype)))
    shape = [word(1 + axis, WORD) for axis in range(member.ndim)]
    strides = [size]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    populate_array(
        array,
        data=word(0, array.data.type),
        shape=cgutils.pack_array(builder, shape),
        strides=cgutils.pack_array(builder, strides),
        itemsize=size,
        meminfo=None,
    )
    return array._getvalue()
