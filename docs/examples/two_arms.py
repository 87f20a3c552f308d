"""Two arms as one robot: a URDF of two Pandas on one table, whose links must not touch each other.

The URDF and the SRDF are made from the Panda's by putting ``left_`` and ``right_`` before every name. To the filter
they are one robot of 14 joints; that one arm keeps off the other is a matter of its self-collision rows.

    python docs/examples/two_arms.py
"""

import tempfile
import xml.etree.ElementTree as ElementTree
from copy import deepcopy
from pathlib import Path

import numpy as np

import cdfctl
from cdfctl.simulation.self_contact import OwnDistances  # coal, pair by pair, apart from the filter's rows

DT = 0.02  # s
SECONDS = 3.0
ARMS = {"left": "0 0.35 0", "right": "0 -0.35 0"}  # m, where they stand
NAMES = ("name", "link", "joint", "parent_link", "link1", "link2")  # attributes that hold a link's or a joint's name


def doubled(source: Path, base: str | None) -> str:
    """An XML robot description with both arms in it; fixed to a world at ``base``, where it is a URDF."""
    both = ElementTree.Element("robot", name="two-arms")
    if base is not None:
        ElementTree.SubElement(both, "link", name="world")
    for side, place in ARMS.items():
        for element in ElementTree.parse(source).getroot():
            if element.tag not in ("link", "joint", "disable_collisions"):
                continue
            arm = deepcopy(element)
            for item in arm.iter():
                for key in NAMES:
                    if key in item.attrib and item.tag in ("link", "joint", "parent", "child", "mimic", arm.tag):
                        item.attrib[key] = f"{side}_{item.attrib[key]}"
            both.append(arm)
        if base is not None:
            stand = ElementTree.SubElement(both, "joint", name=f"{side}_stand", type="fixed")
            ElementTree.SubElement(stand, "parent", link="world")
            ElementTree.SubElement(stand, "child", link=f"{side}_{base}")
            ElementTree.SubElement(stand, "origin", xyz=place)
    return ElementTree.tostring(both, encoding="unicode")


def two_pandas(folder: Path) -> cdfctl.Robot:
    """Write URDF, SRDF and robot file into ``folder``, and load them."""
    panda = cdfctl.load_robot("franka")
    (folder / "two-arms.urdf").write_text(doubled(panda.urdf, "panda_link0"))
    (folder / "two-arms.srdf").write_text(doubled(panda.urdf.parent.parent / "srdf" / "panda.srdf", None))
    fingers = [f"{side}_panda_finger_joint{i}" for side in ARMS for i in (1, 2)]
    merge = [f"{side}_fingers: [{side}_panda_leftfinger, {side}_panda_rightfinger]" for side in ARMS]
    lines = [
        "version: 1",
        "name: two-arms",
        "description: two Pandas on one table",
        "source: made from example-robot-data's panda_description",
        "licence: Apache-2.0 (panda_description)",
        "urdf: two-arms.urdf",
        "srdf: two-arms.srdf",
        f"lock: {{{', '.join(f'{name}: 0.0' for name in fingers)}}}",
        f"merge: {{{', '.join(merge)}}}",
        f"home: {[float(x) for x in np.tile(panda.home, 2)]}",
    ]
    (folder / "two-arms.yaml").write_text("\n".join(lines) + "\n")
    return cdfctl.load_robot(folder / "two-arms.yaml", package_dirs=panda.package_dirs, acceleration_limits=15.0)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        robot = two_pandas(Path(folder))
    own = OwnDistances(robot)
    safe = cdfctl.SafetyFilter(robot, "sdf-tvcbf-qp", dt=DT, alpha=3.0, self_collision=12, self_collision_margin=0.03)
    # each is told to sweep through where the other is
    goal = robot.home.copy()
    goal[[0, 7]] = [-1.5, 1.5]
    q, least, between = robot.home.copy(), np.inf, set()
    for _ in range(int(SECONDS / DT)):
        decision = safe.step(q, cdfctl.Scene(), 1.5 * (goal - q))
        between.update(name for name in decision.active if " near " in name)
        q = q + DT * decision.u
        own.place(q)
        least = min(least, own.distances().min())
    print(f"{robot.n} joints, {len(own.pairs)} pairs of links that can meet; steps: {dict(safe.counts)}")
    print(f"held by: {', '.join(sorted(between))}")
    print(f"least clearance between two links, by coal: {1e3 * least:.1f} mm")


if __name__ == "__main__":
    main()
