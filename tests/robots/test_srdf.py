"""Which links may touch: SRDF files and neighbours."""

from __future__ import annotations

import pytest

from cdfctl.errors import InputError
from cdfctl.robots.robot import load_robot
from cdfctl.robots.srdf import allowed_contacts, read_srdf

LINKS = ("base", "a", "b", "c")


def write(tmp_path, inner: str, root: str = "robot"):
    path = tmp_path / "arm.srdf"
    path.write_text(f'<{root} name="arm">{inner}</{root}>')
    return path


def pair(tag: str, a: str, b: str) -> str:
    return f'<{tag}_collisions link1="{a}" link2="{b}" reason="Never"/>'


def test_pairs_are_read_whichever_link_comes_first(tmp_path):
    path = write(tmp_path, pair("disable", "b", "a") + pair("disable", "a", "c") + pair("disable", "a", "gripper"))
    assert read_srdf(path, LINKS) == {("a", "b"), ("a", "c")}


def test_a_link_disabled_by_default_and_a_pair_enabled_again(tmp_path):
    path = write(tmp_path, '<disable_default_collisions link="c"/>' + pair("enable", "c", "a"))
    assert read_srdf(path, LINKS) == {("base", "c"), ("b", "c")}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<urdf/>", "the root element is <urdf>"),
        ("<robot>", "not well-formed XML"),
        ('<robot><disable_collisions link1="a"/></robot>', "<disable_collisions> needs link2"),
        ('<robot><disable_collisions link1="aa" link2="bb"/></robot>', "names no link of this robot, but 'aa'"),
    ],
)
def test_files_that_are_refused(tmp_path, text, message):
    path = tmp_path / "arm.srdf"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_srdf(path, LINKS)


def test_no_such_file(tmp_path):
    with pytest.raises(InputError, match="no such SRDF file"):
        read_srdf(tmp_path / "none.srdf", LINKS)


def test_neighbours_skip_links_without_geometry_and_a_hull_is_exempt_where_all_its_links_are():
    parents = {"a": "base", "bare": "a", "b": "bare", "f1": "b", "f2": "b"}
    bodies = ("base", "a", "b", "fingers")
    merged = {"fingers": ("f1", "f2")}
    disabled = [("a", "f1"), ("a", "f2"), ("base", "f1")]
    assert allowed_contacts(disabled, parents, bodies, merged) == {
        ("a", "base"): "neighbours",
        ("a", "b"): "neighbours",
        ("b", "fingers"): "neighbours",
        ("a", "fingers"): "SRDF",
    }


def test_a_robot_takes_the_srdf_it_is_given(write_urdf, xml, tmp_path):
    urdf = write_urdf(
        *(xml.link(name) for name in ("base", "l1", "l2")),
        xml.joint("j1", "base", "l1"),
        xml.joint("j2", "l1", "l2"),
    )
    assert load_robot(urdf).allowed_contacts == {("base", "l1"): "neighbours", ("l1", "l2"): "neighbours"}
    path = write(tmp_path, pair("disable", "base", "l2"))
    assert load_robot(urdf, srdf=path).allowed_contacts[("base", "l2")] == "SRDF"


def test_the_franka_s_srdf_is_read():
    allowed = load_robot("franka").allowed_contacts
    assert allowed[("panda_hand", "panda_link5")] == "SRDF"
    assert allowed[("panda_link6", "panda_link7")] == "neighbours"
    assert ("panda_hand", "panda_link1") not in allowed
