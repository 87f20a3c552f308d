"""Give ``cdfctl check`` hostile robot descriptions and meshes, and tell, as JSON lines, what became of each.

``python robot_worker.py SEED COUNT``, in an empty folder with CDFCTL_CACHE set.
"""

from __future__ import annotations

import json
import random
import struct
import sys
from pathlib import Path

from damage import KINDS, spoil  # beside this file
from watched import begin, one

URDF = """\
<?xml version="1.0"?>
<robot name="made">
  <link name="base"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <link name="upper"><collision><origin xyz="0.5 0 0" rpy="0 0 0"/>
    <geometry><mesh filename="part.stl" scale="1 1 1"/></geometry></collision></link>
  <link name="lower"><collision><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
  <joint name="b" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="1 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
</robot>
"""
SCENARIO = """\
version: 1
name: made
robot: {urdf: robot.urdf, q0: [0.1, 0.1]}
task: {type: joint-goal, goal: [0.5, 0.4]}
obstacles: [{name: a, shape: {type: ball, radius: 0.1}, position: [5.0, 0.0, 0.0]}]
controller: {variant: sdf-tvcbf-qp}
assumptions: [Made for a test.]
"""
CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
FACES = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
WORDS = [
    "", "nan", "inf", "-inf", "1e400", "1e308", "-1", "0", "1e-320", "x", "0 0 0", "1 2", "base", "a", "revolute",
    "floating", "fixed", "continuous", "../part.stl", "package://made/../../../../etc/passwd", "package://", "x" * 5000,
    "/dev/zero", "/proc/self/mem", "file:///dev/stdin", "http://127.0.0.1:9/part.stl", ".", "part.obj", "..\\u202e",
]  # fmt: skip


def stl() -> bytes:
    """A tetrahedron as binary STL."""
    data = bytes(80) + struct.pack("<I", len(FACES))
    for face in FACES:
        numbers = [0.0, 0.0, 0.0, *(0.2 * x for corner in face for x in CORNERS[corner])]
        data += struct.pack("<12fH", *numbers, 0)
    return data


def obj() -> bytes:
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS] + ["f " + " ".join(str(i + 1) for i in face) for face in FACES]
    return "\n".join(lines).encode()


def damaged_urdf(rng: random.Random) -> bytes:
    """The URDF with an attribute changed, a piece of text lost, doubled or moved, or bytes spoilt."""
    text = URDF
    for _ in range(rng.choice([1, 1, 2])):
        at = [i for i, character in enumerate(text) if character == '"']
        match rng.randrange(6):
            case 0 | 1 | 2 if len(at) > 2:
                k = 2 * rng.randrange(len(at) // 2)
                text = text[: at[k] + 1] + rng.choice(WORDS) + text[at[k + 1] :]
            case 3:
                lines = text.split("\n")
                lines.insert(rng.randrange(len(lines)), rng.choice(lines))
                text = "\n".join(lines)
            case 4:
                lines = text.split("\n")
                del lines[rng.randrange(len(lines))]
                text = "\n".join(lines)
            case _:
                entity = '<!DOCTYPE robot [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]>'
                deep = "<link>" * 20_000 + "</link>" * 20_000
                text = rng.choice([text.replace("?>", "?>" + entity), text.replace("</robot>", deep + "</robot>")])
    raw = text.encode()
    return spoil(rng.choice(KINDS), raw, rng) if rng.random() < 0.15 else raw


def loop(seed: int, count: int) -> None:
    Path("made.yaml").write_text(SCENARIO)
    Path("robot.urdf").write_text(URDF)
    Path("part.stl").write_bytes(stl())
    print(json.dumps({"case": -1, **one(["check", "./made.yaml"])}), flush=True)
    begin()
    rng = random.Random(seed)
    for i in range(count):
        Path("robot.urdf").write_text(URDF)
        Path("part.stl").write_bytes(stl())
        Path("part.obj").write_bytes(obj())
        if rng.random() < 0.6:
            Path("robot.urdf").write_bytes(damaged_urdf(rng))
        else:
            suffix = rng.choice(["stl", "obj"])
            good = stl() if suffix == "stl" else obj()
            Path(f"part.{suffix}").write_bytes(spoil(rng.choice(KINDS), good, rng))
            Path("robot.urdf").write_text(URDF.replace("part.stl", f"part.{suffix}"))
        print(json.dumps({"case": i, **one(["check", "./made.yaml"])}), flush=True)


if __name__ == "__main__":
    loop(int(sys.argv[1]), int(sys.argv[2]))
