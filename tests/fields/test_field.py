"""The table of fields."""

from __future__ import annotations

import pytest

from cdfctl.errors import InputError
from cdfctl.fields.field import FIELDS, make_field
from cdfctl.robots.robot import load_robot
from cdfctl.types import Scene


def test_a_field_is_made_by_name():
    field = make_field("sdf", load_robot("planar"))
    assert field.unit == "m"
    assert len(field.query([0.0, 0.0], Scene()).d) == 0


def test_an_unknown_name_lists_the_fields():
    with pytest.raises(InputError, match="unknown field 'sdff'") as caught:
        make_field("sdff", load_robot("planar"))
    assert all(name in str(caught.value.hint) for name in FIELDS)
