"""The lowest modes: a beam of known frequencies, both symmetries, bars that hold on a finer mesh, and refusals."""

import numpy as np
import pytest
from skfem import CellBasis, ElementHexS2, ElementVector, MeshHex1, MeshHex2
from stand_ins import PETG, default_housing

from mesh.housing.sweep import flexure_mesh
from pipeline.springs.mounts import attached_to
from sensor.theory.leaf_spring import natural_frequency
from solve.housing import modes
from solve.housing.clamped_half import clamped_half
from solve.housing.modes import Solid, mass_matrix, modes_of
from solve.housing.stiffness import tip_compliance
from solve.linear import SolveError

HOUSING = default_housing()
SOLID = Solid(E=PETG.E_MPa, poisson=PETG.poisson, density=PETG.density_g_per_cm3)
RAYLEIGH = 0.03  # what a rigid shuttle on massless-ended leaves leaves out
ROUND_OFF = 1e-12


def solved(mesh, K):
    return modes_of(clamped_half(mesh, SOLID.E, SOLID.poisson, attached_to(HOUSING)), SOLID, K)


@pytest.fixture(scope="module")
def fine_mesh():
    return flexure_mesh(HOUSING, 2.0)


@pytest.fixture(scope="module")
def K(fine_mesh):
    return tip_compliance(fine_mesh, SOLID.E, SOLID.poisson, attached_to(HOUSING)).K


@pytest.fixture(scope="module")
def found(K):
    return solved(flexure_mesh(HOUSING, 4.0), K)


def test_mass_of_a_block_is_its_volume_times_its_density():
    mesh = MeshHex2.from_mesh(MeshHex1.init_tensor(*(np.linspace(0.0, side, 3) for side in (2.0, 3.0, 4.0))))
    basis = CellBasis(mesh, ElementVector(ElementHexS2()), intorder=3)
    mass = mass_matrix(basis, 5.0)
    for axis in range(3):
        shift = np.zeros(basis.N)
        shift[np.concatenate([basis.nodal_dofs[axis], basis.edge_dofs[axis]])] = 1.0
        assert shift @ (mass @ shift) == pytest.approx(5.0 * 24.0, rel=ROUND_OFF)
    assert np.abs(mass - mass.T).max() == pytest.approx(0.0, abs=ROUND_OFF)


def test_frequency_along_the_press_is_near_rayleigh_s_quotient(found, K):
    """Shuttle of block, tapered neck and tip on two leaves, each with 13/35 of its mass."""
    arm = HOUSING.arms[0]
    section, face = HOUSING.shuttle_width * HOUSING.depth, HOUSING.tip_side**2
    neck = (HOUSING.neck_level - HOUSING.tip_height) * (section + face + (section * face) ** 0.5) / 3.0
    block = section * (arm.top_level - HOUSING.neck_level) + neck + face * HOUSING.tip_height
    leaf = arm.flexure.thickness * arm.flexure.length * arm.flexure.depth
    grams = 1e-3 * SOLID.density
    assert found.frequencies_Hz[0] == pytest.approx(natural_frequency(K[0], grams * block, grams * leaf), rel=RAYLEIGH)


def test_bars_hold_the_modes_of_a_finer_mesh(found, fine_mesh, K):
    finer = solved(fine_mesh, K)
    assert finer.shapes == found.shapes
    apart = np.abs(np.array(found.frequencies_Hz) / np.array(finer.frequencies_Hz) - 1.0)
    assert np.all(apart < np.array(found.errors))
    assert max(found.errors) < 0.02


def test_mode_that_does_not_answer_its_own_inertia_is_refused(monkeypatch, K):
    solve = modes.eigsh

    def wrong(*arguments, **options):
        values, vectors = solve(*arguments, **options)
        return 1.001 * values, vectors

    monkeypatch.setattr(modes, "eigsh", wrong)
    with pytest.raises(SolveError):
        solved(flexure_mesh(HOUSING, 4.0), K)
