import numpy as np
import pytest

from reference.flat_punch.body import RoundBody, whole_matrices
from reference.flat_punch.grid import Grid
from sensor.theory.soft_tissue import FLESH_LAWS
from solve.compression.flesh_law import FleshLaw

GRID = Grid(r=np.array([0.0, 0.4, 1.0, 1.7]), z=np.array([0.0, -0.5, -1.2]))


def places(grid):
    """Return r and z of every node, shape (nodes, 2)."""
    return np.stack(np.meshgrid(grid.r_nodes, grid.z_nodes, indexing="ij"), axis=-1).reshape(-1, 2)


def deep(body, rng):
    """Return displacements (nodes, 2) of flesh that is pressed by half of its height, none of them off the axis."""
    uneven = 0.02 * rng.standard_normal((body.count, 2)) * places(GRID)[:, :1]
    return uneven + places(GRID) * [0.2, -0.5]


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("name", FLESH_LAWS)
def test_uniform_strain_has_the_energy_of_its_law(name, poisson):
    law = FleshLaw(name=name, poisson=poisson)
    body = RoundBody(GRID, law)
    stretches = np.array([1.2, 0.7, 1.2])  # radial, up, hoop
    density = law.phi(stretches)[0].sum() + law.U(np.log(stretches.prod()))[0]
    volume = np.pi * 1.7**2 * 1.2
    assert body.volume == pytest.approx(volume, rel=1e-14)
    assert body.deformed(places(GRID) * [0.2, -0.3]).energy == pytest.approx(volume * density, rel=1e-12)


def test_turning_inside_out_costs_infinite_energy():
    body = RoundBody(GRID, FleshLaw())
    assert body.deformed(places(GRID) * [0.0, -1.5]).energy == np.inf


@pytest.mark.parametrize("poisson", [0.0, 0.45])
@pytest.mark.parametrize("name", FLESH_LAWS)
def test_forces_and_matrices_are_derivatives_of_the_energy(name, poisson, rng):
    body = RoundBody(GRID, FleshLaw(name=name, poisson=poisson))
    u = deep(body, rng)
    way = rng.standard_normal((body.count, 2)) * places(GRID)[:, :1]
    step = 1e-6
    forces, entries = body.tangent(body.deformed(u))
    after, before = body.deformed(u + step * way), body.deformed(u - step * way)
    slope = (after.energy - before.energy) / (2.0 * step)
    assert forces @ way.ravel() == pytest.approx(slope, rel=1e-6)
    turn = (body.tangent(after)[0] - body.tangent(before)[0]) / (2.0 * step)
    along = body.assembled(np.einsum("eab,be->ae", whole_matrices(entries), way.ravel()[body.dofs]))
    np.testing.assert_allclose(along, turn, rtol=1e-5, atol=1e-6 * np.abs(turn).max())


def test_projected_matrices_are_not_indefinite(rng):
    body = RoundBody(GRID, FleshLaw(poisson=0.45))
    bent = body.deformed(deep(body, rng))
    exact, projected = (
        np.linalg.eigvalsh(whole_matrices(body.tangent(bent, projected=each)[1])) for each in (False, True)
    )
    assert exact.min() < -1e-3 * exact.max()
    assert projected.min() > -1e-12 * projected.max()
