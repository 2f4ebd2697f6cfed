"""STL files of other programs: what slicers pass over, and what they count."""

import struct

import numpy as np
import pytest
import trimesh

from cad.checks.part_checks import check_file
from cad.checks.triangle_checks import without_spare_triangles

SIZE = (20.0, 10.0, 5.0)
VOLUME = 1000.0
BOX = np.array(trimesh.creation.box(SIZE).triangles)
COLLAPSED = np.array([[BOX[0, 0], BOX[0, 1], BOX[0, 1]]])
ON_A_LINE = np.array([[BOX[0, 0], 0.5 * (BOX[0, 0] + BOX[0, 1]), BOX[0, 1]]])
NAME = b"twintip"


def inner(size, *, inward, at=(0.0, 0.0, 0.0)):
    """Return the triangles of a box within, or beside, the other one."""
    mesh = trimesh.creation.box(size).apply_translation(at)
    if inward:
        mesh.invert()
    return np.array(mesh.triangles)


def binary(corners, header=NAME, count=None, after=b"", attribute=b"\0\0"):
    told = len(corners) if count is None else count
    facets = [struct.pack("<12f", 0.0, 0.0, 0.0, *facet.ravel()) + attribute for facet in corners]
    return header.ljust(80) + struct.pack("<I", told) + b"".join(facets) + after


def text(corners, first="solid part\n", last="endsolid part\n"):
    lines = [first]
    for facet in corners:
        vertices = "".join("   vertex {:.6e} {:g} {:g}\n".format(*corner) for corner in facet)
        lines.append(f" facet normal 0 0 0\n  outer loop\n{vertices}  endloop\n endfacet\n")
    return ("".join(lines) + last).encode()


def verdicts_of(data, tmp_path):
    (tmp_path / "part.stl").write_bytes(data)
    return {verdict.name.removeprefix("geometry."): verdict for verdict in check_file(tmp_path / "part.stl")}


TEXT = text(BOX)


@pytest.mark.parametrize(
    ("data", "is_told"),
    [
        (binary(BOX), False),
        (binary(BOX, header=b"solid by CAD"), False),
        (binary(BOX, header=b"COLOR=\x80\x80\x80\xff", attribute=b"\x1f\x80"), False),
        (binary(BOX, after=b"\r\n"), True),
        (binary(BOX, header=b"solid by CAD", after=b"\n"), True),
        (binary(BOX, count=0), True),
        (binary(BOX, count=2**32 - 1), True),
        (binary(np.concatenate([BOX, COLLAPSED])), True),
        (binary(np.concatenate([BOX, ON_A_LINE])), True),
        (TEXT, False),
        (TEXT.upper(), False),
        (TEXT.replace(b"\n", b"\r\n"), False),
        (TEXT.replace(b" ", b"\t"), False),
        (text(BOX, first="\nsolid\n", last="end solid"), False),
        (text(BOX, last=""), True),
        (text(np.concatenate([BOX, COLLAPSED]), last=""), True),
        (TEXT + b" facet normal 0 0 0\n outer loop\n vertex 0 0 0\n", True),
        (text(BOX[:6]) + text(BOX[6:], "solid rest\n"), False),
    ],
)
def test_closed_part_passes_and_what_is_passed_over_is_said(data, is_told, tmp_path):
    verdicts = verdicts_of(data, tmp_path)
    assert [name for name, verdict in verdicts.items() if not verdict.passed] == []
    assert ("readable" in verdicts) is is_told
    assert verdicts["volume"].value == pytest.approx(VOLUME, rel=1e-6)
    assert verdicts["units"].value == pytest.approx(SIZE[0], rel=1e-6)


@pytest.mark.parametrize(
    ("data", "failing"),
    [
        (binary(BOX[1:]), {"watertight"}),
        (binary(BOX)[:-100], {"watertight"}),
        (binary(BOX)[:-60], {"readable"}),
        (TEXT[: len(TEXT) // 2], {"watertight"}),
        (binary(np.concatenate([BOX[1:], COLLAPSED])), {"watertight"}),
        (binary(np.concatenate([BOX, BOX[:1]])), {"manifold"}),
        (binary(BOX[:0]), {"readable"}),
        (text(BOX[:0]), {"readable"}),
        (TEXT.replace(b"vertex 1", b"vertex one"), {"readable"}),
        (TEXT.replace(b"vertex 1", b"vertex nan"), {"readable"}),
        (b"", {"readable"}),
    ],
)
def test_planted_fault_fails(data, failing, tmp_path):
    assert failing <= {name for name, verdict in verdicts_of(data, tmp_path).items() if not verdict.passed}


@pytest.mark.parametrize(
    ("others", "bodies", "volume"),
    [
        ([inner((10.0, 4.0, 2.0), inward=True)], 1, VOLUME - 80.0),
        ([inner((4.0, 4.0, 2.0), inward=True, at=(x, 0.0, 0.0)) for x in (-5.0, 5.0)], 1, VOLUME - 64.0),
        ([inner((10.0, 4.0, 2.0), inward=True), inner((2.0, 1.0, 0.5), inward=False)], 2, VOLUME - 79.0),
        ([inner((10.0, 4.0, 2.0), inward=False)], 2, VOLUME + 80.0),
        ([inner((10.0, 4.0, 2.0), inward=True, at=(40.0, 0.0, 0.0))], 2, VOLUME - 80.0),
    ],
)
def test_cavity_is_no_body(others, bodies, volume, tmp_path):
    verdicts = verdicts_of(binary(np.concatenate([BOX, *others])), tmp_path)
    assert (verdicts["one_solid"].value, verdicts["one_solid"].passed) == (bodies, bodies == 1)
    assert verdicts["volume"].value == pytest.approx(volume, rel=1e-6)
    assert verdicts["watertight"].passed


def test_triangle_that_joins_a_long_edge_to_short_ones_stays():
    start, end = trimesh.creation.box(SIZE).edges_unique[0]
    mesh = trimesh.creation.box(SIZE)
    middle = len(mesh.vertices)
    vertices = np.concatenate([mesh.vertices, [0.5 * (mesh.vertices[start] + mesh.vertices[end])]])
    has_edge = [index for index, face in enumerate(mesh.faces) if {start, end} <= set(face)]
    a, b, c = np.roll(mesh.faces[has_edge[0]], -int(np.flatnonzero(~np.isin(mesh.faces[has_edge[0]], (start, end)))[0]))
    faces = [face for index, face in enumerate(mesh.faces.tolist()) if index != has_edge[0]]
    seamed = trimesh.Trimesh(vertices, [*faces, (a, b, middle), (a, middle, c), (b, c, middle)], process=False)
    kept, spare = without_spare_triangles(seamed)
    assert (len(kept.faces), spare, kept.is_watertight) == (14, 0, True)
