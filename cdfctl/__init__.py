"""Safe motion of robot arms among moving obstacles.

The same parts as the ``cdfctl`` command, for someone's own control loop::

    import cdfctl

    robot = cdfctl.load_robot("franka")
    scene = cdfctl.Scene([cdfctl.Obstacle(cdfctl.Sphere(0.05), position=[0.5, 0.2, 0.6], velocity=[0, -0.5, 0])])
    field = cdfctl.make_field("sdf", robot)
    answer = field.query(robot.home, scene)

Importing ``cdfctl`` is cheap: each name below is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cdfctl.control.safety_filter import SafetyFilter
    from cdfctl.errors import CdfctlError
    from cdfctl.fields.field import make_field
    from cdfctl.robots.robot import Robot, load_robot
    from cdfctl.types import Box, Capsule, ConvexMesh, Cylinder, Decision, Obstacle, PointCloud, Scene, Sphere

__version__ = "0.1.0"

__all__ = [
    "Box",
    "Capsule",
    "CdfctlError",
    "ConvexMesh",
    "Cylinder",
    "Decision",
    "Obstacle",
    "PointCloud",
    "Robot",
    "SafetyFilter",
    "Scene",
    "Sphere",
    "__version__",
    "load_robot",
    "make_field",
]

_HOME = {
    "Box": "cdfctl.types",
    "Capsule": "cdfctl.types",
    "CdfctlError": "cdfctl.errors",
    "ConvexMesh": "cdfctl.types",
    "Cylinder": "cdfctl.types",
    "Decision": "cdfctl.types",
    "Obstacle": "cdfctl.types",
    "PointCloud": "cdfctl.types",
    "Robot": "cdfctl.robots.robot",
    "SafetyFilter": "cdfctl.control.safety_filter",
    "Scene": "cdfctl.types",
    "Sphere": "cdfctl.types",
    "load_robot": "cdfctl.robots.robot",
    "make_field": "cdfctl.fields.field",
}


def __getattr__(name: str) -> object:
    """Import the home of a public name at its first use (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'cdfctl' has no attribute '{name}'")
    value: object = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
