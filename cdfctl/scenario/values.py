"""The building blocks of the schema: strict models, numbers, draws and lists, with error texts of our own.

Every check here raises :class:`pydantic_core.PydanticCustomError` of type ``cdfctl`` with the message a user reads, so
that no wording of pydantic ever reaches one. Hint and finer place travel in the error's context.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from cdfctl.errors import InputError


class Strict(BaseModel):
    """A frozen model that takes nothing it does not know and converts nothing silently."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


def about(description: str, unit: str = "", source: str = "ours") -> Any:
    """A field's description, unit and the source of its default: what the reference page is made of."""
    return Field(description=description, json_schema_extra={"x-unit": unit, "x-source": source})


MOST = 1e12
"""The greatest number, whatever its unit: products of a few of them are still numbers."""

Place = tuple[str | int, ...]
Complaint = tuple[str, str | None, Place]
"""A message, a hint or None, and the place below the validated value."""


def refuse(message: str, hint: str | None = None, at: Place = ()) -> PydanticCustomError:
    """The error to raise in a validator; ``at`` is the place below the validated value, where that is finer."""
    return refuse_all([(message, hint, at)])


def refuse_all(complaints: list[Complaint]) -> PydanticCustomError:
    """The same for several complaints at once."""
    # A found mapping's braces must not be read as a template: the text travels in the context.
    return PydanticCustomError("cdfctl", "{text}", {"text": complaints[0][0], "complaints": complaints})


def found(value: object) -> str:
    """What stands in the file, in words: ``text '1.0'``, ``a list of 2``, ``nothing``."""
    if value is None:
        return "nothing (null)"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value) if isinstance(value, float) or abs(value) < 10**20 else "a number too large"
    if isinstance(value, str):
        short = value if len(value) <= 40 else value[:37] + "..."
        return f"text {short!r}"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}" if value else "an empty list"
    if isinstance(value, dict):
        keys = ", ".join(str(key) for key in list(value)[:4])
        return f"a mapping with {keys}" if value else "an empty mapping"
    return type(value).__name__


class Uniform(Strict):
    """A number drawn once a trial, uniformly from [a, b]; ``mirrored``: it or its negative, with equal chance."""

    uniform: tuple[float, float]
    mirrored: Literal[True] | None = None


@dataclass(frozen=True)
class Real:
    """Annotation: a finite number, within bounds, drawable or not.

    Attributes:
        above: the number must be greater than this.
        least: the number must be at least this.
        most: the number must be at most this.
        drawable: ``{uniform: [a, b]}`` may stand in its place.
    """

    above: float | None = None
    least: float | None = None
    most: float | None = None
    drawable: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        number: dict[str, Any] = {"type": "number"}
        if self.above is not None:
            number["exclusiveMinimum"] = self.above
        if self.least is not None:
            number["minimum"] = self.least
        if self.most is not None:
            number["maximum"] = self.most
        if not self.drawable:
            return number
        pair = {"type": "array", "items": number, "minItems": 2, "maxItems": 2}
        draw = {
            "type": "object",
            "properties": {"uniform": pair, "mirrored": {"const": True}},
            "required": ["uniform"],
            "additionalProperties": False,
        }
        return {"anyOf": [number, draw]}

    def check(self, value: object) -> float | Uniform:
        """``value`` as a float or a draw, or the error that says why not."""
        if isinstance(value, Uniform):
            value = value.model_dump(exclude_none=True)
        if isinstance(value, dict):
            return self._draw(value)
        return self._number(value)

    def _number(self, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise refuse(f"expected a number, found {found(value)}", _number_hint(value))
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise refuse(f"expected a finite number, found {found(number)}")
        if abs(number) > MOST:
            raise refuse(f"must be within ±{MOST:g}, found {found(value)}")
        if self.above is not None and not number > self.above:
            raise refuse(f"must be greater than {self.above:g}, found {found(value)}")
        if self.least is not None and not number >= self.least:
            raise refuse(f"must be at least {self.least:g}, found {found(value)}")
        if self.most is not None and not number <= self.most:
            raise refuse(f"must be at most {self.most:g}, found {found(value)}")
        return number

    def _draw(self, value: dict[Any, Any]) -> Uniform:
        if not self.drawable:
            only = "draws are for robot.q0, task and obstacles, so that every controller meets the same trial"
            raise refuse(f"expected one number, found {found(value)}", only if "uniform" in value else None)
        if not {"uniform"} <= set(value) <= {"uniform", "mirrored"}:
            raise refuse(f"expected a number, found {found(value)}", "a draw is written {uniform: [a, b]}")
        if value.get("mirrored", True) is not True:
            raise refuse(f"mirrored is true or left out, found {found(value['mirrored'])}")
        ends = value["uniform"]
        if not isinstance(ends, list | tuple) or len(ends) != 2:
            raise refuse(f"uniform needs two numbers [a, b], found {found(ends)}")
        low, high = (self._number(end) for end in ends)
        if low > high:
            raise refuse(f"uniform needs a <= b, found [{low!r}, {high!r}]")
        if "mirrored" not in value:
            return Uniform(uniform=(low, high))
        if low < 0.0:
            raise refuse(f"a mirrored draw needs 0 <= a <= b, found [{low!r}, {high!r}]")
        self._number(-high)
        return Uniform(uniform=(low, high), mirrored=True)


@dataclass(frozen=True)
class RealOr:
    """Annotation: one number for all joints, or one each: a ``list``, or a ``mapping`` by joint name."""

    real: Real
    kind: Literal["list", "mapping"]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        number = self.real.__get_pydantic_json_schema__(schema, handler)
        if self.kind == "list":
            return {"anyOf": [number, {"type": "array", "items": number, "minItems": 1}]}
        return {"anyOf": [number, {"type": "object", "additionalProperties": number}]}

    def check(self, value: object) -> float | tuple[float, ...] | dict[str, float]:
        """``value`` as a number, or a tuple or mapping of numbers, or the error that says why not."""
        items: list[tuple[str | int, object]]
        if self.kind == "list" and isinstance(value, list | tuple) and value:
            items = list(enumerate(value))
        elif self.kind == "mapping" and isinstance(value, dict):
            items = list(value.items())
        elif isinstance(value, int | float) and not isinstance(value, bool):
            return number(self.real.check(value))
        else:
            raise refuse(f"expected a number or a {self.kind} of numbers, found {found(value)}", _number_hint(value))
        good: dict[str | int, float] = {}
        complaints: list[Complaint] = []
        for key, item in items:
            try:
                good[key] = number(self.real.check(item))
            except PydanticCustomError as error:
                complaints += [(m, h, (key, *at)) for m, h, at in (error.context or {})["complaints"]]
        if complaints:
            raise refuse_all(complaints)
        return tuple(good.values()) if self.kind == "list" else {str(key): x for key, x in good.items()}


def _number_hint(value: object) -> str | None:
    if not isinstance(value, str):
        return None
    text = value.strip()
    if text.lower().endswith(("deg", "°", "degrees")):
        return "angles are in radians, written as plain numbers"
    try:
        float(text)
    except ValueError:
        if text.replace(",", ".").replace(".", "", 1).lstrip("+-").isdigit() and "," in text:
            return "write the decimals after a point"
        return "numbers are written out: no units, no formulas"
    return "a number has no quotes and no underscores"


@dataclass(frozen=True)
class ListOf:
    """A check of a list's length, before its items are looked at: exactly ``exact`` items, or at least ``least``."""

    exact: int | None = None
    least: int = 0
    noun: str = "numbers"

    def __call__(self, value: object) -> tuple[object, ...]:
        wanted = f"{self.exact} {self.noun}" if self.exact is not None else self.noun
        if not isinstance(value, list | tuple):
            hint = "each item of a list begins with '- '" if isinstance(value, dict) else None
            raise refuse(f"expected a list of {wanted}, found {found(value)}", hint)
        if self.exact is not None and len(value) != self.exact:
            raise refuse(f"expected a list of {wanted}, found {found(value)}")
        if len(value) < self.least:
            raise refuse(f"expected at least {self.least} {self.noun}, found {found(value)}")
        return tuple(value)


def _text(value: object) -> object:
    if not isinstance(value, str):
        hint = "put it in quotes" if isinstance(value, bool | int | float) else None
        raise refuse(f"expected text, found {found(value)}", hint)
    if any(not (c.isprintable() or c == "\n") for c in value):
        raise refuse(f"text must not hold control characters, found {found(value)}")
    return value


def _named(value: object) -> object:
    text = _text(value)
    assert isinstance(text, str)
    if not text.strip():
        raise refuse("expected text, found an empty one")
    return text


def _flag(value: object) -> object:
    if not isinstance(value, bool):
        hint = "YAML 1.2 knows true and false only" if str(value).lower() in ("yes", "no", "on", "off") else None
        raise refuse(f"expected true or false, found {found(value)}", hint)
    return value


@dataclass(frozen=True)
class Whole:
    """A check that a value is a whole number from ``least`` to ``most``."""

    least: int
    most: int

    def __call__(self, value: object) -> object:
        if isinstance(value, bool) or not isinstance(value, int):
            raise refuse(f"expected a whole number, found {found(value)}")
        if not self.least <= value <= self.most:
            raise refuse(f"must be from {self.least} to {self.most}, found {found(value)}")
        return value


Text = Annotated[str, BeforeValidator(_text)]
Label = Annotated[str, BeforeValidator(_named)]
Flag = Annotated[bool, BeforeValidator(_flag)]
Plain = Annotated[float, Real()]
PlainPositive = Annotated[float, Real(above=0.0)]
PlainNonNegative = Annotated[float, Real(least=0.0)]
Share = Annotated[float, Real(least=0.0, most=1.0)]
PerJoint = Annotated[float | tuple[float, ...], RealOr(Real(least=0.0), "list")]
PositivePerJoint = Annotated[float | tuple[float, ...], RealOr(Real(above=0.0), "list")]
PositiveByName = Annotated[float | dict[str, float], RealOr(Real(above=0.0), "mapping")]
Number = Annotated[float | Uniform, Real(drawable=True)]
Positive = Annotated[float | Uniform, Real(above=0.0, drawable=True)]
NonNegative = Annotated[float | Uniform, Real(least=0.0, drawable=True)]
Vector = Annotated[tuple[Number, ...], BeforeValidator(ListOf(least=1))]
Vector3 = Annotated[tuple[Number, Number, Number], BeforeValidator(ListOf(exact=3))]
Positive3 = Annotated[tuple[Positive, Positive, Positive], BeforeValidator(ListOf(exact=3))]
Quaternion = Annotated[tuple[Number, Number, Number, Number], BeforeValidator(ListOf(exact=4))]
Points = Annotated[tuple[Vector3, ...], BeforeValidator(ListOf(noun="points [x, y, z]"))]


def number(value: float | Uniform) -> float:
    """``value`` of a drawn scenario as a float.

    Raises:
        InputError: it is still a draw.
    """
    if isinstance(value, Uniform):
        low, high = value.uniform
        raise InputError(f"the scenario still holds a draw, uniform [{low}, {high}]: draw a trial first")
    return value


def floats(values: Iterable[float | Uniform]) -> tuple[float, ...]:
    """A vector of a drawn scenario as floats (an :class:`InputError` if it still holds a draw)."""
    return tuple(number(value) for value in values)


def low(value: float | Uniform) -> float:
    """The least value a number can take."""
    if isinstance(value, Uniform):
        return -value.uniform[1] if value.mirrored else value.uniform[0]
    return value


def high(value: float | Uniform) -> float:
    """The greatest value a number can take."""
    return value.uniform[1] if isinstance(value, Uniform) else value
