"""Mesh files."""

from __future__ import annotations

import numpy as np
import pytest

from cdfctl.errors import InputError
from cdfctl.robots.meshes import load_vertices
from cdfctl.types import ConvexMesh

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def stl() -> str:
    facets = []
    for face in FACES:
        corners = "".join("vertex {} {} {}\n".format(*CORNERS[i]) for i in face)
        facets.append(f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    return "solid t\n" + "".join(facets) + "endsolid t\n"


def obj() -> str:
    lines = ["v {} {} {}".format(*c) for c in CORNERS] + ["f {} {} {}".format(*(i + 1 for i in f)) for f in FACES]
    return "\n".join(lines) + "\n"


def ply() -> str:
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 4\nproperty list uchar int vertex_index\nend_header\n"
    return head + "".join("{} {} {}\n".format(*c) for c in CORNERS) + "".join("3 {} {} {}\n".format(*f) for f in FACES)


@pytest.mark.parametrize(("suffix", "text"), [(".stl", stl()), (".obj", obj()), (".ply", ply()), (".STL", stl())])
def test_vertices_of_a_file(tmp_path, suffix, text):
    path = tmp_path / f"tetrahedron{suffix}"
    path.write_text(text)
    assert {tuple(v) for v in load_vertices(path)} == {tuple(map(float, c)) for c in CORNERS}
    assert {tuple(v) for v in ConvexMesh(path).vertices} == {tuple(map(float, c)) for c in CORNERS}


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.stl", None, "no such mesh file"),
        ("mesh.txt", "solid", "unknown mesh format"),
        ("empty.stl", "", "not a readable mesh: .*empty"),
        ("pointer.stl", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "not a readable mesh"),
        ("points.obj", "v 0 0 0\nv 1 0 0\n", "not a readable mesh"),
        ("bad.dae", "<a/>", "not a readable mesh"),
    ],
)
def test_what_is_no_mesh(tmp_path, name, content, message):
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=message) as caught:
        load_vertices(path)
    assert "\n" not in caught.value.message
    assert "/src/" not in caught.value.message


def test_a_directory_is_no_mesh(tmp_path):
    (tmp_path / "d.stl").mkdir()
    with pytest.raises(InputError, match="is a directory"):
        load_vertices(tmp_path / "d.stl")


def test_vertices_are_not_shared_with_the_loader(tmp_path):
    path = tmp_path / "t.obj"
    path.write_text(obj())
    first = load_vertices(path)
    first += 1.0
    assert np.abs(load_vertices(path) - first).max() >= 1.0
