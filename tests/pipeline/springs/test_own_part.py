"""`twintip.stiffness`: beams whose stiffness is a formula, in every direction of the sweep, and what is refused."""

from types import SimpleNamespace

import cadquery as cq
import numpy as np
import OCP
import pytest
from refusal import refusal

import twintip
from cad.checks.own_part import faces_at, find_extrusion
from cad.checks.own_part import own_part as own_part_of
from mesh.own_part import swept_part
from mesh.session import MeshError
from pipeline.springs import own_part
from solve.own_part import PartCompliance, extrapolate_to_size_zero

LONG, THICK, DEEP, FOOT = 20.0, 1.0, 6.0, 1.0  # of a leaf with a foot at its end [mm]
E = 2000.0
OUTLINE = [(0.0, 0.0), (LONG, 0.0), (LONG, -3.0), (LONG + FOOT, -3.0), (LONG + FOOT, THICK), (0.0, THICK)]
PRESSED = (LONG + 0.5 * FOOT, -0.5 * DEEP, -3.0)
HELD = (0.0, -0.5 * DEEP, 0.5 * THICK)


def leaf(outline=OUTLINE):
    """Return the leaf in the plane of x and z, with y from -DEEP to 0."""
    return cq.Workplane("XZ").polyline(outline).close().extrude(DEEP)


def solved(solid=None, held=HELD, pressed=PRESSED, **material):
    """Return the stiffness of the leaf at its foot, with its bar [N/mm]."""
    found = twintip.stiffness(
        solid or leaf(), held=held, pressed={"foot": pressed}, **{"E_MPa": E, "poisson": 0.0, **material}
    )
    return found.faces["foot"], found


@pytest.fixture(scope="module")
def plain():
    return solved()


def test_a_cantilever_is_as_stiff_as_a_beam(plain):
    """Without lateral contraction a leaf is a beam of Euler, but for shear and what root and corner give.

    Shear is 0.14 %; wall and foot give no more than a tenth of the thickness longer a leaf would each: 3 x 0.2 / 20.
    """
    arm = LONG + 0.5 * FOOT
    stiff = 3.0 * E * (DEEP * THICK**3 / 12.0) / (arm**3 - (arm - LONG) ** 3)
    face, found = plain
    assert pytest.approx(stiff, rel=0.03) == face.K
    assert face.K_error < 0.01
    assert found.left_out_mm3 == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("axis", "angle"),
    [
        pytest.param((1.0, 0.0, 0.0), 90.0, marks=pytest.mark.slow),
        pytest.param((0.0, 0.0, 1.0), 90.0, marks=pytest.mark.slow),
        ((1.0, 1.0, 1.0), 33.0),
    ],
)
def test_a_turned_part_is_as_stiff(plain, axis, angle):
    place = cq.Location(cq.Vector(), cq.Vector(*axis), angle)
    held, pressed = ((place * cq.Location(cq.Vector(*point))).toTuple()[0] for point in (HELD, PRESSED))
    face, _ = solved(leaf().val().moved(place), held=held, pressed=pressed)
    assert pytest.approx(plain[0].K, rel=plain[0].K_error + face.K_error) == face.K


def test_tags_name_faces_and_numbers_may_be_those_of_numpy(plain):
    solid = leaf()
    solid.faces("<X").tag("wall")
    solid.faces("<Z").tag("foot")
    face, _ = solved(solid, held="wall", pressed="foot")
    assert plain[0].K == face.K
    face, _ = solved(held=np.array(HELD), E_MPa=np.int64(E))
    assert plain[0].K == face.K


def test_a_pocket_is_left_out_and_bounded(plain):
    """A pocket of 2 x 0.8 x 0.5 mm in the side of the leaf takes stiffness away, which the bar must say."""
    pocket = cq.Workplane("XZ").center(10.0, 0.5 * THICK).rect(2.0, 0.8).extrude(0.5)
    face, found = solved(leaf().cut(pocket))
    assert found.left_out_mm3 == pytest.approx(0.8, rel=0.5)  # by lines 0.4 mm apart
    assert face.K_error > plain[0].K_error


@pytest.mark.slow
def test_a_narrow_cut_is_in_the_bar(plain, monkeypatch):
    """A cut of 0.05 mm, 4 of 6 mm deep, is a thousandth of the leaf, and takes 36 % of its stiffness by tetrahedra."""
    monkeypatch.setattr(own_part, "MAX_SECONDS", 0.0)
    cut = cq.Workplane("XZ").center(3.0, 0.5 * THICK).rect(0.05, 3.0 * THICK).extrude(4.0)
    face, _ = solved(leaf().cut(cut))
    assert face.K * (1.0 - face.K_error) < 0.64 * plain[0].K


def test_a_wall_that_is_held_on_one_side_only_is_not_mirrored(plain):
    """The held half carries a leaf that twists about it: softer than the leaf that is held all over."""
    face, _ = solved(leaf_with_split_wall(-0.5 * DEEP), held=(0.0, -0.75 * DEEP, 0.5 * THICK))
    assert face.K * (1.0 + face.K_error) < 0.95 * plain[0].K


@pytest.mark.parametrize("level", [-2.5, -3.4])
def test_a_wall_whose_edge_lies_between_two_layers_is_not_swept(level):
    """Its facets would hold more or less than the face."""
    solid = leaf_with_split_wall(level)
    faces = {"held": faces_at(solid, "held", [(0.0, -0.9 * DEEP, 0.5 * THICK)])}
    with pytest.raises(MeshError, match="face 'held'"):
        swept_part(find_extrusion(own_part_of(solid, faces)), 1.0, 2)


def leaf_with_split_wall(level):
    """Return the leaf whose wall is two faces, which meet at a level y [mm]."""
    solid = leaf().val()
    splitter = OCP.BRepFeat.BRepFeat_SplitShape(solid.wrapped)
    edge = cq.Edge.makeLine(cq.Vector(0.0, level, 0.0), cq.Vector(0.0, level, THICK))
    splitter.Add(edge.wrapped, leaf_wall(solid).wrapped)
    splitter.Build()
    return cq.Shape.cast(splitter.Shape())


def leaf_wall(solid):
    """Return the face of a leaf at x = 0."""
    return min(solid.Faces(), key=lambda face: face.Center().x)


def balled():
    """Return the leaf with a ball on its end, which is no extrusion."""
    return leaf().union(cq.Workplane("XY").sphere(4.0).translate((LONG + 0.5 * FOOT, -0.5 * DEEP, THICK + 3.9)))


@pytest.mark.slow
def test_a_part_that_is_no_extrusion_is_solved_in_tetrahedra(plain):
    """A ball on the end of the leaf stands above its foot, where it gives nothing and stiffens nothing."""
    face, found = solved(balled())
    assert "tetrahedra" in found.method
    assert len(found.curve) >= 3
    assert abs(face.K - plain[0].K) <= face.K * face.K_error + plain[0].K * plain[0].K_error
    assert face.K_error < 0.05


# K of both tips of the housing in benchmarks/flexure.py on four meshes of tetrahedra, and as extrapolated there [N/m].
ON_TETRAHEDRA = {
    "low": ((1629.275, 1627.534, 1605.166, 1596.715), 1558.08),
    "high": ((39654.46, 38971.74, 38358.45, 37784.10), 36404.6),
}


@pytest.mark.parametrize("tip", ON_TETRAHEDRA)
def test_tetrahedra_of_the_default_housing_have_its_stiffness_inside_their_bar(tip, monkeypatch):
    """The meshes of another part have the compliance that those of the housing had; a fifth would cost too much."""
    K, truth = ON_TETRAHEDRA[tip]
    compliance = iter(np.array([[1e3 / each]]) for each in K)
    nodes = iter([*(50 for _ in K), int(own_part.MAX_SECONDS / 1e-5)])
    monkeypatch.setattr(own_part, "tetrahedral_mesh", lambda *_: SimpleNamespace(doflocs=np.empty((3, next(nodes)))))
    monkeypatch.setattr(
        own_part,
        "tetrahedral_compliance",
        lambda *_: PartCompliance(
            C=next(compliance), strain_per_N=(), strain_inside_per_N=(), density=(), at_corners=np.zeros((1, 0)),
            dofs=150, seconds=0.0,
        ),
    )  # fmt: skip
    face, found = solved(balled())
    assert len(found.curve) == len(K)
    assert pytest.approx(1e-3 * truth, rel=face.K_error) == face.K


def test_a_step_that_is_small_by_accident_sets_no_bar():
    sizes = (4.0, 2.0, 1.0)
    assert extrapolate_to_size_zero(sizes, (7.0, 6.0, 5.5)) == pytest.approx(
        (5.0, 0.5), rel=1e-12
    )  # linear in the size
    assert extrapolate_to_size_zero(sizes, (7.0, 6.0, 6.0)) == pytest.approx((6.0, 0.5), rel=1e-12)


SHARP = [(-3, -3), (0, -3), (0, 0), (10, 0), (10, -2), (12, -2), (12, 1), (0, 1), (0, 4), (-3, 4)]


def test_the_bar_holds_where_a_leaf_ends_at_sharp_corners():
    """There meshes converge like their size only: twice as fine ones differ by less than what both miss.

    Expected are full and reduced integration, which have it between them, on elements of a hundredth of the thickness
    at the three corners.
    """
    solid = cq.Workplane("XZ").polyline(SHARP).close().extrude(2.0)
    face, _ = solved(solid, held=(-3.0, -1.0, 0.5), pressed=(11.0, -1.0, -2.0))
    assert pytest.approx(0.67079, rel=face.K_error) == face.K
    assert face.K_error < 0.01


FOOTLESS = cq.Workplane("XZ").rect(20.0, 10.0).extrude(DEEP)
REFUSED = {
    "no such tag": (None, {"held": "wall"}, "held"),
    "held and pressed": (None, {"held": PRESSED}, "foot"),
    "a block": (FOOTLESS, {"held": (-10.0, -3.0, 0.0), "pressed": (10.0, -3.0, 0.0)}, "stiffness at foot"),
    "on an edge": (None, {"held": (0.0, -3.0, 0.0)}, "held"),
    "not a number": (None, {"held": (0.0, float("nan"), 0.0)}, "held"),
    "no workplane": (cq.Assembly(leaf()), {}, "PART"),
    "a stiffness as text": (None, {"E_MPa": "2000"}, "E_MPa"),
    "no finite stiffness": (None, {"E_MPa": float("inf")}, "E_MPa"),
    "incompressible": (None, {"poisson": 0.5}, "poisson"),
}


@pytest.mark.parametrize(("solid", "changed", "field"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_solved_is_refused(solid, changed, field):
    assert field in refusal(solved, solid, **changed).field
