import dataclasses

import cadquery as cq
import numpy as np
import pytest
from skfem import MeshTet1

from cad.parts.part import Part, named_part
from mesh.quality import check_quality
from mesh.session import MeshError
from mesh.volume import SizeField, check_against_part, volume_mesh

ROUND_OFF = 1e-9
COARSE = SizeField(largest_mm=1.0)


def box():
    """Return a block 3 x 2 x 1 mm with two named faces."""
    faces = {
        "left": lambda face: face.Center().x < 1e-6,
        "upper": lambda face: face.Center().z > 1.0 - 1e-6,
    }
    return named_part("box", cq.Solid.makeBox(3.0, 2.0, 1.0), faces)


def test_names_out_are_the_names_in_and_lie_where_the_faces_lie():
    mesh = volume_mesh(box(), COARSE)
    assert set(mesh.boundaries) == {"left", "upper"}
    assert np.all(mesh.p[0, mesh.facets[:, mesh.boundaries["left"]]] == 0.0)
    assert np.all(mesh.p[2, mesh.facets[:, mesh.boundaries["upper"]]] == 1.0)


def test_size_grows_from_the_outline_of_a_face_but_not_from_a_cut():
    part = box()
    free = SizeField(smallest_mm=0.1, growth=0.5, largest_mm=1.0, faces=("left",))
    cut = dataclasses.replace(free, cuts=("upper",))
    shared = {}
    for key, size in {"free": free, "cut": cut}.items():
        mesh = volume_mesh(part, size)
        on_curve = np.all(
            (np.abs(mesh.p[0]) < ROUND_OFF)[mesh.edges] & (np.abs(mesh.p[2] - 1) < ROUND_OFF)[mesh.edges], 0
        )
        shared[key] = np.count_nonzero(on_curve)
        assert mesh.t.shape[1] > volume_mesh(part, COARSE).t.shape[1]
    assert shared["free"] == pytest.approx(2.0 / 0.1, abs=1)
    assert shared["cut"] < shared["free"]


def test_curved_part_needs_the_tolerance_of_its_facets():
    cylinder = named_part("cylinder", cq.Solid.makeCylinder(1.0, 1.0), {"base": lambda face: face.Center().z < 1e-6})
    with pytest.raises(MeshError, match="volume"):
        volume_mesh(cylinder, SizeField(largest_mm=0.3))
    # A polygon of sides h on radius r is short of the disc by (h/r)^2 / 6.
    volume_mesh(cylinder, SizeField(largest_mm=0.3), tolerance=0.3**2 / 6.0)


def test_size_at_an_unknown_face_lists_the_known_ones():
    size = SizeField(smallest_mm=0.1, growth=1.0, largest_mm=1.0, faces=("rigth",))
    with pytest.raises(MeshError, match="rigth"):
        volume_mesh(box(), size)


@pytest.mark.parametrize(
    ("other", "said"),
    [(cq.Solid.makeBox(3.0, 2.0, 1.5), "face 0"), (cq.Solid.makeCylinder(1.0, 1.0), "3 faces")],
)
def test_solid_with_other_faces_is_refused(other, said, monkeypatch):
    monkeypatch.setattr(Part, "write_brep", lambda _, path: other.exportBrep(str(path)))
    with pytest.raises(MeshError, match=said):
        volume_mesh(box(), COARSE)


def test_mesh_with_a_face_too_small_or_a_part_too_large_is_refused():
    part = box()
    mesh = volume_mesh(part, COARSE)
    left = mesh.boundaries["left"]
    for wrong, said in (
        (mesh.with_boundaries({"left": left[1:]}), "left"),
        (mesh.scaled(1.001), "volume"),
        (MeshTet1(mesh.p, mesh.t).with_boundaries({"left": left}), "upper"),
    ):
        with pytest.raises(MeshError, match=said):
            check_against_part(wrong, part, ROUND_OFF)


def test_sliver_and_inverted_tetrahedron_are_refused():
    corner = np.vstack([np.zeros(3), np.eye(3)]).T  # at its right angle det J is the product of the edges
    assert check_quality(corner, np.array([[0, 1, 2, 3]]).T, 0.0) == pytest.approx(np.sqrt(0.5))
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 0.01]]).T
    for nodes, least in (([0, 1, 2, 3], 0.05), ([0, 2, 1, 3], 0.0)):
        with pytest.raises(MeshError, match="Jacobian"):
            check_quality(points, np.array([nodes]).T, least)
