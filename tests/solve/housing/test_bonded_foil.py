"""Foils on leaves: exact integrals over their own rectangle, beams with skins, and what a misplaced one is told."""

import dataclasses

import numpy as np
import pytest
from skfem import ElementHexS2

from cad.parts.housing import Housing
from mesh.housing.sweep import flexure_mesh
from pipeline.springs.mounts import bonded_foils
from sensor.theory.leaf_spring import Flexure
from sensor.theory.strain_gauge import FOIL, sandwich_gain
from solve.elasticity import vector_basis
from solve.housing.bonded_foil import bridge_strains, membrane_matrix
from solve.housing.stiffness import EDGE_STIFFNESS, housing_stiffness, tip_compliance
from solve.linear import SolveError

HOUSING = Housing(
    low=Flexure(thickness=0.8, length=32.0, depth=10.0, separation=14.0, fillet=0.5),
    high=Flexure(thickness=1.2, length=32.0, depth=10.0, separation=14.0, fillet=0.5),
    tip_side=1.0, tip_height=1.0, spacing=8.0, shuttle_width=6.0, neck_level=5.5, lower_leaf_level=7.6,
    low_top_level=24.0, high_top_level=24.45, cavity_level=24.75, top_level=30.75, protrusion=1.7, gauges="foil",
)  # fmt: skip
TITANIUM = (110000.0, 0.34)
FOILS = bonded_foils(HOUSING)
A, B = 3e-3, -1e-3


@pytest.fixture(scope="module")
def mesh():
    return flexure_mesh(HOUSING, 2.0)


@pytest.fixture(scope="module")
def basis(mesh):
    return vector_basis(mesh, ElementHexS2(), order=3)


@pytest.fixture(scope="module")
def plain(mesh):
    return tip_compliance(mesh, *TITANIUM)


@pytest.fixture(scope="module")
def gauged(mesh):
    return tip_compliance(mesh, *TITANIUM, FOILS)


def field(basis, displacement):
    """Return the dofs of a displacement given at the places (3, n) of the nodes."""
    values = displacement(basis.doflocs)
    u = np.zeros(basis.N)
    for component in range(3):
        numbers = np.unique(basis.element_dofs[component::3])
        u[numbers] = values[component][numbers]
    return u


def foil(**changes):
    return dataclasses.replace(FOILS[1], **changes)


@pytest.mark.parametrize("start", [0.0, 0.37, 2.9])
def test_energy_of_a_uniform_strain_is_that_of_the_foil_wherever_its_edges_lie(basis, start):
    """Half of the foil lies in the half y >= 0: E t / (1 - nu^2) (a^2 + b^2 + 2 nu a b) x its area."""
    (x0, x1), _ = FOILS[1].outline
    one = foil(outline=((x0 + start, x1 + start), (-1.7, 1.7)))
    u = field(basis, lambda p: np.array([A * p[0], B * p[1], 0.0 * p[2]]))
    E_t, nu = one.stiffness, one.poisson
    expected = E_t / (1.0 - nu**2) * (A * A + B * B + 2.0 * nu * A * B) * abs(x1 - x0) * 1.7
    assert u @ membrane_matrix(basis, [one]) @ u == pytest.approx(expected, rel=1e-10)


def test_strain_under_a_grid_is_the_mean_of_what_it_covers(basis):
    """U = c x^2 z has the strain 2 c x z along x: on a grid that of its middle, with the sign of its arm."""
    u = field(basis, lambda p: np.array([A * p[0] ** 2 * p[2], 0.0 * p[0], 0.0 * p[0]]))
    found = bridge_strains(basis, FOILS, np.stack([u, u], axis=1))
    for tip, strain in enumerate(found):
        grids = [one for one in FOILS if one.grid and one.tip == tip]
        assert len(grids) == 4
        arms = [one.sign * 2.0 * A * 0.5 * sum(one.grid[0]) * one.z for one in grids]
        assert strain == pytest.approx(abs(np.mean(arms)), rel=1e-9)


def test_skins_on_stiff_leaves_act_as_on_a_beam(plain, gauged):
    """On titanium the sections stay plane: what the gauges add is the sandwich beam's, but for fillets and width."""
    for i, one in enumerate((HOUSING.low, HOUSING.high)):
        beam = sandwich_gain(TITANIUM[0], one.profile, one.length, FOIL)
        found = gauged.K[i] / plain.K[i]
        assert found - 1.0 == pytest.approx(beam - 1.0, rel=0.08)


def test_stiffness_is_carried_on_by_its_share_of_the_step_between_the_meshes(gauged):
    coarse = gauged
    fine = dataclasses.replace(coarse, C=coarse.C / 0.99, dofs=coarse.dofs + 1)
    found = housing_stiffness(fine, coarse)
    step = 1.0 / 0.99 - 1.0
    assert pytest.approx([K / (1.0 + (1.0 + EDGE_STIFFNESS[0]) * step) for K in coarse.K], rel=1e-12) == found.K
    assert found.error == pytest.approx([EDGE_STIFFNESS[1] * step] * 2, rel=1e-9)
    assert housing_stiffness(dataclasses.replace(fine, gauge_strain_per_N=None), coarse).K == fine.K


@pytest.mark.parametrize(
    "changes",
    [
        {"z": 3.0},
        {"outline": ((-60.0, -55.0), (-1.5, 1.5))},
        {"outline": ((-20.0, -15.0), (-6.0, 6.0))},
        {"name": "symmetry"},
    ],
)
def test_foil_that_is_not_on_a_leaf_is_refused(basis, changes):
    with pytest.raises(SolveError):
        membrane_matrix(basis, [foil(**changes)])


def test_leaf_whose_facets_are_no_rectangles_is_refused(mesh):
    x, y, z = mesh.doflocs
    skew = dataclasses.replace(mesh, doflocs=np.array([x + 0.1 * y, y, z]))
    with pytest.raises(SolveError):
        membrane_matrix(vector_basis(skew, ElementHexS2(), order=3), [FOILS[1]])
