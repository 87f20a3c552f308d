"""Small URDFs written by the tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

BOX = '<collision><geometry><box size="0.2 0.1 0.4"/></geometry></collision>'
LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="1"/>'

UrdfWriter = Callable[..., Path]


def joint(name: str, parent: str, child: str, kind: str = "revolute", inner: str = LIMIT, axis: str = "0 0 1") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 0.5" rpy="0.1 0.2 0.3"/><axis xyz="{axis}"/>{inner}</joint>'
    )


def link(name: str, inner: str = BOX) -> str:
    return f'<link name="{name}">{inner}</link>'


def mesh(filename: str, more: str = "") -> str:
    return f'<collision><geometry><mesh filename="{filename}" {more}/></geometry></collision>'


@pytest.fixture(scope="session")
def xml() -> SimpleNamespace:
    """Builders of URDF text: ``joint``, ``link``, ``mesh``, and the constants ``BOX``, ``LIMIT``."""
    return SimpleNamespace(joint=joint, link=link, mesh=mesh, BOX=BOX, LIMIT=LIMIT)


@pytest.fixture
def write_urdf(tmp_path: Path) -> UrdfWriter:
    """Write ``<robot>`` with the given inner text and return the file's path."""

    def write(*parts: str, name: str = "arm.urdf") -> Path:
        path = tmp_path / name
        path.write_text('<?xml version="1.0"?>\n<robot name="arm">' + "".join(parts) + "</robot>")
        return path

    return write
