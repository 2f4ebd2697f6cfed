import dataclasses

import gmsh
import numpy as np
import pytest
from skfem import MeshHex1, MeshHex2

from cad.parts.housing import BackToBack, Housing
from cad.parts.housing_solid import housing_part
from mesh.housing.blocks import straight_block
from mesh.housing.profile import mesh_profile
from mesh.housing.sweep import check_flexure_mesh, check_jacobian, flexure_mesh, stretch_leaves
from mesh.session import MeshError
from sensor.theory.leaf_spring import Flexure

LOW = Flexure(thickness=0.8, length=28.3, depth=10.0, separation=14.0, fillet=0.5)
HIGH = Flexure(thickness=1.2, length=14.9, depth=10.0, separation=14.0, fillet=0.5)
HOUSING = Housing(
    low=LOW, high=HIGH, tip_side=1.0, tip_height=1.0, spacing=8.0, shuttle_width=6.0, neck_level=5.5,
    lower_leaf_level=7.6, low_top_level=24.0, high_top_level=24.45, cavity_level=24.75, top_level=30.75, protrusion=1.7,
)  # fmt: skip


def changed(low=None, high=None, **sizes):
    flexures = {"low": dataclasses.replace(LOW, **(low or {})), "high": dataclasses.replace(HIGH, **(high or {}))}
    return dataclasses.replace(HOUSING, **flexures, **sizes)


TWIN = BackToBack(pad_height=0.2, dowel_hole=2.9)
SLIM = {"thickness": 0.4, "length": 60.0, "depth": 6.0}
VARIANTS = {
    "plastic": HOUSING,
    "small tip": changed(tip_side=0.2, tip_height=0.9, neck_level=5.8),
    "tip as deep as the plate": changed({"depth": 6.0}, {"depth": 6.0}, tip_side=6.0, tip_height=3.0, neck_level=5.0),
    "steel": changed(SLIM, {"thickness": 0.5, "length": 25.0, "depth": 6.0}, neck_level=3.5),
    "shortest leaves": changed({"length": 4.0}, {"length": 6.0}),
    "hole level with a leaf": changed(hole_inset=6.0),
    "little solid beside a root": changed(lower_leaf_level=6.65),
    "holes far in": changed(hole_inset=9.5),
    "plate of a square": changed(back_to_back=TWIN),
    "plate of a square with equal arms": changed({"length": 14.9}, back_to_back=TWIN),
    "plate of a square with a longer high arm": changed({"length": 12.0}, back_to_back=TWIN),
}


@pytest.fixture(scope="module")
def mesh():
    return flexure_mesh(HOUSING, 2.0)


QUICK = ("plastic", "steel", "hole level with a leaf", "plate of a square")


@pytest.mark.parametrize(
    "housing",
    [
        pytest.param(housing, id=name, marks=() if name in QUICK else pytest.mark.slow)
        for name, housing in VARIANTS.items()
    ],
)
def test_mesh_has_the_volume_the_surface_and_the_named_areas_of_the_solid(housing):
    size = housing_part(housing).size
    for scale in (1.0, 2.0):
        check_flexure_mesh(flexure_mesh(housing, scale), size)


def test_named_facets_lie_where_their_faces_lie(mesh):
    def nodes(name):
        return mesh.p[:, mesh.facets[:, mesh.boundaries[name]]]

    for name, centre in (("low_tip", -4.0), ("high_tip", 4.0)):
        x, y, z = nodes(name)
        assert np.all(z == 0.0)
        assert (x.min(), x.max(), y.max()) == pytest.approx((centre - 0.5, centre + 0.5, 0.5))
    assert np.all(nodes("symmetry")[1] == 0.0)
    x, _, z = nodes("mounting_holes")
    away = np.min([np.hypot(x - hole[0], z - hole[1]) for hole in HOUSING.holes], axis=0)
    assert away == pytest.approx(1.7)
    x, _, z = nodes("low_leaves")
    assert (x.min(), x.max()) == pytest.approx(HOUSING.arms[0].roots)
    assert np.abs(np.abs(z - 14.6) - 7.0).max() == pytest.approx(0.4 + 0.5)


SQUARE = VARIANTS["plate of a square"]


@pytest.mark.parametrize(
    ("made_for", "wanted", "scale"),
    [
        (HOUSING, changed({"length": 31.0}, {"length": 13.5}), 2.0),
        # the wall of the short arm is stretched between its root and its post, whose holes stay round
        *((SQUARE, changed({"length": 27.5}, {"length": 15.3}, back_to_back=TWIN), scale) for scale in (1.0, 2.0)),
    ],
)
def test_stretched_mesh_fills_the_solid_with_the_new_leaves(made_for, wanted, scale):
    mesh = flexure_mesh(made_for, scale)
    moved = stretch_leaves(mesh, made_for, wanted)
    check_flexure_mesh(moved, housing_part(wanted).size)
    assert set(moved.boundaries) == set(mesh.boundaries)


@pytest.mark.parametrize(
    ("made_for", "low", "high"),
    [(HOUSING, 40.0, 14.9), (SQUARE, 22.5, 18.4), (SQUARE, 25.0, 25.0)],
    ids=["too long", "no wall left", "equal arms"],
)
def test_stretch_too_far_asks_for_a_fresh_mesh(made_for, low, high):
    wanted = changed({"length": low}, {"length": high}, back_to_back=made_for.back_to_back)
    assert stretch_leaves(flexure_mesh(made_for, 2.0), made_for, wanted) is None


def test_stretch_of_another_thickness_is_refused(mesh):
    with pytest.raises(MeshError, match="lengths"):
        stretch_leaves(mesh, HOUSING, changed({"thickness": 0.81}))


@pytest.mark.parametrize(
    ("housing", "facets", "said"),
    [
        (changed({"thickness": 0.81}), {}, r"stage 'compare': volume = .* within 0.0001"),
        (HOUSING, {"low_tip": slice(1, None)}, "area of face 'low_tip'"),
        (HOUSING, {"low_tip": slice(0)}, "face 'low_tip' has no facets"),
    ],
)
def test_mesh_of_another_housing_is_refused(mesh, housing, facets, said):
    less = {name: mesh.boundaries[name][kept] for name, kept in facets.items()}
    with pytest.raises(MeshError, match=said):
        check_flexure_mesh(mesh.with_boundaries({**mesh.boundaries, **less}), housing_part(housing).size)


def test_elements_that_touch_without_sharing_a_facet_are_told_by_the_surface(mesh):
    loose = mesh.t.copy()
    loose[:, 0] = np.arange(8) + mesh.p.shape[1]
    split = MeshHex2.from_mesh(MeshHex1(np.hstack([mesh.p, mesh.p[:, mesh.t[:, 0]]]), loose))
    places = split.doflocs.copy()
    places[:, split.dofs.element_dofs] = mesh.doflocs[:, mesh.dofs.element_dofs]
    split = dataclasses.replace(split, doflocs=places)
    with pytest.raises(MeshError, match="surface ="):
        check_flexure_mesh(split, housing_part(HOUSING).size)


def test_folded_element_is_refused(mesh):
    places = mesh.doflocs.copy()
    corner = mesh.t[0, 100]
    others = mesh.p[:, mesh.t[1:, 100]]
    places[:, corner] = 2.0 * others.mean(axis=1) - places[:, corner]
    with pytest.raises(MeshError, match="Jacobian"):
        check_jacobian(dataclasses.replace(mesh, doflocs=places))


def test_holes_without_a_wall_between_them_are_refused():
    with pytest.raises(MeshError, match="holes"):
        flexure_mesh(changed(hole_diameter=1.0, hole_inset=14.3), 1.0)
    assert not gmsh.isInitialized()


def test_neighbours_with_different_counts_are_refused():
    left = straight_block([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], 2, 3)
    right = straight_block([(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0)], 2, 4)
    with pytest.raises(MeshError, match="into 3 elements, and another into 4"):
        mesh_profile([left, right])
    assert not gmsh.isInitialized()
