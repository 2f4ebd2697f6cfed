"""STL files of other programs: those that common programs write are read, and faulty ones fail in one line."""

import struct

import numpy as np
import pytest
import trimesh

from cad.checks.part_checks import check_file

SIZE = (20.0, 10.0, 5.0)
VOLUME = 1000.0
BOX = np.array(trimesh.creation.box(SIZE).triangles)
COLLAPSED = np.array([[BOX[0, 0], BOX[0, 1], BOX[0, 1]]])
CAVITY = np.array(trimesh.creation.box((10.0, 4.0, 2.0)).triangles)[:, ::-1]
NAME = b"twintip"


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
    "data",
    [
        binary(BOX),
        binary(BOX, header=b"COLOR=\x80\x80\x80\xff", attribute=b"\x1f\x80"),
        binary(BOX, count=0),  # of a program that writes triangles before it knows how many
        binary(BOX, count=2**32 - 1),
        binary(np.concatenate([BOX, COLLAPSED])),
        TEXT,
        TEXT.upper(),
        TEXT.replace(b"\n", b"\r\n"),
        TEXT.replace(b" ", b"\t"),
        text(BOX, last=""),
        text(BOX[:6]) + text(BOX[6:], "solid rest\n"),
    ],
)
def test_closed_part_passes(data, tmp_path):
    verdicts = verdicts_of(data, tmp_path)
    assert [name for name, verdict in verdicts.items() if not verdict.passed] == []
    assert verdicts["volume"].value == pytest.approx(VOLUME, rel=1e-6)
    assert verdicts["units"].value == pytest.approx(SIZE[0], rel=1e-6)


@pytest.mark.parametrize(
    ("data", "failing"),
    [
        (binary(BOX)[:-100], {"watertight"}),
        (binary(BOX)[:-60], {"readable"}),
        (binary(BOX, after=b"\n"), {"readable"}),
        (text(BOX[:6]), {"watertight"}),
        (TEXT + b" facet normal 0 0 0\n outer loop\n vertex 0 0 0\n", {"readable"}),
        (binary(np.concatenate([BOX, CAVITY])), {"one_solid"}),
        (binary(np.concatenate([BOX[1:], COLLAPSED])), {"watertight"}),
        (binary(BOX[:0]), {"readable"}),
        (TEXT.replace(b"vertex 1", b"vertex one"), {"readable"}),
        (TEXT.replace(b"vertex 1", b"vertex nan"), {"readable"}),
        (b"", {"readable"}),
    ],
)
def test_planted_fault_fails(data, failing, tmp_path):
    assert failing <= {name for name, verdict in verdicts_of(data, tmp_path).items() if not verdict.passed}
