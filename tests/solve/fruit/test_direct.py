import dataclasses

import numpy as np
import pytest
from skfem import ElementTetP1, ElementTetP2, MeshTet

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.parts.fruit import fruit_block, fruit_half, fruit_quarter
from mesh.fruit import REFINEMENTS, edge_size, fruit_mesh, fruit_meshes
from solve.elasticity import stiffness_matrix, vector_basis
from solve.fruit.compliance import FruitCompliance
from solve.fruit.direct import (
    check_balance,
    check_mesh,
    direct_compliance,
    mesh_compliance,
    outline_size,
    tip_stiffness,
)
from solve.linear import SolveError

TIPS = Tips(side_mm=1.0, spacing_mm=8.0)
BLOCK = Fruit(length_mm=20.0, width_mm=20.0, height_mm=12.0, poisson=0.3)
# s11, s12 [1/mm] of the block 20 x 20 x 12 mm under two 1 mm squares 8 mm apart, by Poisson's ratio. 0.3: half-space
# split with spectral elements and hp finite elements of order 5 to 7, both to 2e-6; 0.45: the split alone, to 2e-5.
REFERENCE = {0.3: (0.766603, 0.010526), 0.45: (0.67325, 0.00874)}
SOLVER = 1e-9  # relative accuracy asked of each linear solve


@pytest.fixture(scope="module")
def meshes():
    """Return a family of three meshes, each twice as coarse as that of the product."""
    return tuple(fruit_mesh(fruit_quarter(BLOCK, TIPS), BLOCK, TIPS, scale) for scale in (2.0, 1.0, 0.5))


@pytest.fixture(scope="module", params=[pytest.param(0.3, marks=pytest.mark.slow), 0.45])
def reference(request, meshes):
    """Return the result and the reference: on the meshes of the product, and at 0.45 on the next coarser family."""
    fruit = dataclasses.replace(BLOCK, poisson=request.param)
    family = meshes if request.param > 0.3 else fruit_meshes(BLOCK, TIPS)
    return direct_compliance(family, fruit, TIPS), REFERENCE[request.param], family


def test_reference_lies_inside_the_error_bars(reference):
    found, (s11, s12), _ = reference
    (low, cross), (cross_again, high) = found.S
    assert low == high
    assert cross == cross_again
    assert abs(low - s11) <= found.error_own * low
    bar = found.error_pair * (low - cross)
    assert abs((low - cross) - (s11 - s12)) <= bar
    assert abs(cross - s12) <= bar


def test_error_bars_are_not_cheaply_wide(reference):
    found, (s11, s12), meshes = reference
    of_the_product = outline_size(meshes[-1]) < 1.01 * edge_size(TIPS, REFINEMENTS[-1])
    assert found.error_pair <= (3e-3 if of_the_product else 1e-2)
    # The finest mesh alone is 1 or 2 % off; the extrapolated value must be worth its three solves.
    assert found.S[0][0] == pytest.approx(s11, rel=2e-3)
    assert found.S[0][1] == pytest.approx(s12, rel=2e-2)
    assert found.K_m_over_E() == pytest.approx(1.0 / (s11 - s12), rel=2e-3)


def test_result_tells_its_cost_and_how_it_was_found(reference):
    found, _, meshes = reference
    assert isinstance(found, FruitCompliance)
    assert found.info.dofs == vector_basis(meshes[-1], ElementTetP2(), 2).N
    assert found.info.seconds > 0.0
    assert "three meshes at rate 1 (observed" in found.info.status


@pytest.fixture(scope="module")
def coarse_and_fine(meshes):
    return [mesh_compliance(mesh, 0.3).S for mesh in meshes[1:]]


def test_every_mesh_is_too_stiff_and_finer_ones_less_so(coarse_and_fine):
    coarse, fine = coarse_and_fine
    s11, s12 = REFERENCE[0.3]
    for sign in (1.0, -1.0):  # prescribed displacement bounds the energy of each load mode from above
        modes = [coarse[0, 0] + sign * coarse[0, 1], fine[0, 0] + sign * fine[0, 1], s11 + sign * s12]
        assert modes == sorted(modes)


def test_error_of_one_mesh_halves_with_the_size_at_the_edge(coarse_and_fine):
    s11 = REFERENCE[0.3][0]
    coarse, fine = (1.0 - S[0, 0] / s11 for S in coarse_and_fine)
    assert np.log2(coarse / fine) == pytest.approx(1.0, abs=0.15)  # unstructured meshes scatter by some per cent


@pytest.fixture(scope="module")
def off_centre():
    tips = Tips(side_mm=1.0, spacing_mm=8.0, offset_mm=4.0)
    return fruit_mesh(fruit_block(BLOCK, tips), BLOCK, tips, 2.0)


def test_crosstalk_is_reciprocal_for_two_separate_loads_off_the_centre(off_centre):
    S = mesh_compliance(off_centre, 0.3).S
    assert S[0, 1] == pytest.approx(S[1, 0], abs=SOLVER * S[0, 0])
    assert (
        S[1, 1] > 1.02 * S[0, 0]
    )  # the high tip stands 1.5 sides from the edge of the block, the low one in the middle


def test_each_press_alone_gives_the_same_as_both_from_one_factorisation(off_centre):
    basis = vector_basis(off_centre, ElementTetP2(), 2)
    K = stiffness_matrix(basis, 1.0, 0.3)
    clamp = {"base": (1, 2, 3)}
    together = tip_stiffness(basis, K, clamp, ("low_tip", "high_tip"))
    swapped = tip_stiffness(basis, K, clamp, ("high_tip", "low_tip"))
    assert together == pytest.approx(swapped[::-1, ::-1], rel=SOLVER, abs=SOLVER * together[0, 0])


def test_half_and_whole_block_agree():
    tips = Tips(spacing_mm=8.0, offset_mm=1.5)
    half, whole = (
        mesh_compliance(fruit_mesh(make(BLOCK, tips), BLOCK, tips, 2.0), 0.3).S for make in (fruit_half, fruit_block)
    )
    # Each mesh is 7 to 8 % too stiff at this size; two unstructured meshes differ by a quarter of that.
    assert half == pytest.approx(whole, rel=2e-2)


def test_quarter_and_half_agree():
    quarter, half = (
        mesh_compliance(fruit_mesh(make(BLOCK, TIPS), BLOCK, TIPS, 2.0), 0.3).S for make in (fruit_quarter, fruit_half)
    )
    assert quarter == pytest.approx(half, rel=2e-2)


def test_a_mesh_mirrored_in_x_exchanges_the_tips():
    tips = Tips(offset_mm=2.0)
    mesh = fruit_mesh(fruit_half(BLOCK, tips), BLOCK, tips, 4.0)
    S = mesh_compliance(mesh, 0.3).S
    names = {"low_tip": "high_tip", "high_tip": "low_tip"}
    mirrored = MeshTet(mesh.p * [[-1.0], [1.0], [1.0]], mesh.t)
    mirrored = mirrored.with_boundaries({names.get(name, name): facets for name, facets in mesh.boundaries.items()})
    assert pytest.approx(S[::-1, ::-1], rel=SOLVER, abs=SOLVER) == mesh_compliance(mirrored, 0.3).S


def test_compliance_scales_with_one_over_length():
    tips = Tips(offset_mm=1.0)
    mesh = fruit_mesh(fruit_half(BLOCK, tips), BLOCK, tips, 4.0)
    S, scaled = (mesh_compliance(one, 0.3).S for one in (mesh, mesh.scaled(3.0)))
    assert scaled == pytest.approx(S / 3.0, rel=SOLVER, abs=SOLVER)


def column() -> MeshTet:
    """Return a quarter of a column, pressed over its whole top: 2 x 3 mm, 4 mm high."""
    mesh = MeshTet.init_tensor(np.linspace(0, 2, 3), np.linspace(0, 3, 3), np.linspace(-4, 0, 4))
    return mesh.with_boundaries(
        {
            "base": lambda x: x[2] < -4.0 + 1e-9,
            "high_tip": lambda x: x[2] > -1e-9,
            "symmetry_x": lambda x: x[0] < 1e-9,
            "symmetry_y": lambda x: x[1] < 1e-9,
        }
    )


def test_column_on_a_sliding_base_has_the_stiffness_of_a_bar():
    E, poisson = 2.5, 0.3
    basis = vector_basis(column(), ElementTetP2(), 2)
    held = {"base": (3,), "symmetry_x": (1,), "symmetry_y": (2,)}
    found = tip_stiffness(basis, stiffness_matrix(basis, E, poisson), held, ("high_tip",))
    assert found == pytest.approx(np.array([[E * 2.0 * 3.0 / 4.0]]), rel=SOLVER)


def test_spring_to_nowhere_breaks_the_balance():
    basis = vector_basis(column(), ElementTetP1(), 1)
    K = stiffness_matrix(basis, 1.0, 0.3).tolil()
    dof = basis.get_dofs(lambda x: np.abs(x[2] + 4.0 / 3.0) < 1e-9).all("u^3")[0]
    K[dof, dof] += 0.01
    with pytest.raises(SolveError, match=r"add up to .* must be at most 1e-08"):
        tip_stiffness(basis, K.tocsc(), {"base": (1, 2, 3)}, ("high_tip",))


def test_reactions_that_do_not_balance_or_are_not_reciprocal_are_refused():
    balanced = np.array([[2.0, -0.1], [-0.1, 3.0]])
    check_balance(balanced, -balanced.sum(axis=0))
    with pytest.raises(SolveError, match="check that every support is named"):
        check_balance(balanced, -balanced.sum(axis=0) * (1.0 + 1e-6))
    skew = balanced + np.array([[0.0, 1e-6], [0.0, 0.0]])
    with pytest.raises(SolveError, match="change places"):
        check_balance(skew, -skew.sum(axis=0))
    with pytest.raises(SolveError, match="add up to nan"):
        check_balance(balanced, np.array([np.nan, 0.0]))


def test_base_held_sideways_only_is_refused():
    basis = vector_basis(column(), ElementTetP1(), 1)
    held = {"base": (1, 2), "symmetry_x": (1,), "symmetry_y": (2,)}
    with pytest.raises(SolveError, match="supports base, symmetry_x, symmetry_y: one must hold u_z; clamp the base"):
        tip_stiffness(basis, stiffness_matrix(basis, 1.0, 0.3), held, ("high_tip",))


@pytest.mark.parametrize("missing", ["base", "high_tip"])
def test_missing_boundary_is_named_with_the_known_ones(missing):
    mesh = column()
    bare = MeshTet(mesh.p, mesh.t).with_boundaries({k: v for k, v in mesh.boundaries.items() if k != missing})
    with pytest.raises(
        SolveError, match=rf"boundary '{missing}' is unknown on the mesh; known boundaries: .*symmetry_x"
    ):
        mesh_compliance(bare, 0.3)
    with pytest.raises(SolveError, match="'high_tip' is unknown on the mesh; known boundaries: none"):
        outline_size(MeshTet())


def test_size_of_the_outline_is_that_asked_of_the_mesh(meshes):
    for scale, mesh in zip((1.0, 0.5), meshes[1:], strict=True):
        assert outline_size(mesh) == pytest.approx(edge_size(TIPS, scale), rel=1e-6)


def test_size_of_the_outline_leaves_out_the_cut():
    mesh = column()
    # Of the 2 x 3 mm footprint the sides x = 2 and y = 3 remain: 5 mm in two edges of 1 mm and two of 1.5 mm.
    assert outline_size(mesh) == pytest.approx(5.0 / 4.0)


@pytest.mark.parametrize(
    ("fruit", "tips", "message"),
    [
        (Fruit(length_mm=21.0), TIPS, "length of the mesh = 10 mm: must be 10.5 mm"),
        (Fruit(width_mm=19.0), TIPS, "width of the mesh = 10 mm: must be 9.5 mm"),
        (Fruit(height_mm=11.0), TIPS, "height of the mesh = 12 mm: must be 11 mm"),
        (BLOCK, Tips(side_mm=1.1), "high_tip length of the mesh = 1 mm: must be 1.1 mm"),
        (BLOCK, Tips(spacing_mm=7.0), "high_tip centre of the mesh = 4 mm: must be 3.5 mm"),
        (BLOCK, Tips(offset_mm=0.5), "high_tip centre of the mesh = 4 mm: must be 4.5 mm"),
    ],
)
def test_mesh_of_another_fruit_or_of_other_tips_is_refused(meshes, fruit, tips, message):
    check_mesh(meshes[0], BLOCK, TIPS)
    with pytest.raises(SolveError, match=message):
        direct_compliance(meshes, fruit, tips)


def test_meshes_that_are_no_family_are_refused():
    mesh = fruit_mesh(fruit_quarter(BLOCK, TIPS), BLOCK, TIPS, 4.0)
    with pytest.raises(ValueError, match="coarse to fine"):
        direct_compliance((mesh, mesh), BLOCK, TIPS)
    with pytest.raises(ValueError, match="must be 2 or 3 of each"):
        direct_compliance((mesh,), BLOCK, TIPS)


def test_two_meshes_give_a_wider_bar_and_say_so():
    part = fruit_quarter(BLOCK, TIPS)
    found = direct_compliance([fruit_mesh(part, BLOCK, TIPS, scale) for scale in (4.0, 2.0)], BLOCK, TIPS)
    s11, _ = REFERENCE[0.3]
    assert abs(found.S[0][0] - s11) <= found.error_own * found.S[0][0]
    assert "two meshes" in found.info.status


def test_an_error_too_wide_to_tell_anything_is_refused(monkeypatch):
    """Two coarse meshes of the block know it to a few per cent: too little where 0.1 % is the limit."""
    monkeypatch.setattr("solve.fruit.direct.WIDEST_ERROR", 1e-3)
    part = fruit_quarter(BLOCK, TIPS)
    with pytest.raises(SolveError, match=r"relative error of s11 - s12 = 0\.\d+: must be at most 0.001; take a fruit"):
        direct_compliance([fruit_mesh(part, BLOCK, TIPS, scale) for scale in (4.0, 2.0)], BLOCK, TIPS)
