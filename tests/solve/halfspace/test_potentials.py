"""Half-space fields checked by themselves: Hooke's law on finite differences, equilibrium, and the load they carry."""

import numpy as np
import pytest

from solve.elasticity import lame_parameters
from solve.halfspace.potentials import displacement, point_load, rectangle_load, stress

SIDES = (1.3, 0.7)
POISSON = (-0.5, 0.0, 0.3, 0.4999)
STEP = 1e-4
# Central differences with step h lose h^2/6 of the third derivative: 1e-8 / 6 times about 1e3 near the load.
DIFFERENCE = 2e-5


@pytest.fixture
def points(rng):
    """Return points at a depth of at least 0.4, off every axis of symmetry."""
    return np.stack([rng.uniform(-1.5, 1.5, 60), rng.uniform(-1.5, 1.5, 60), rng.uniform(0.4, 2.0, 60)])


def gradient(field, points):
    """Return d field / d x_b by central differences, the axis b last."""
    sides = []
    for axis in range(3):
        step = np.zeros((3, 1))
        step[axis] = STEP
        sides.append((field(points + step) - field(points - step)) / (2.0 * STEP))
    return np.stack(sides, axis=-1)


@pytest.mark.parametrize("poisson", POISSON)
def test_stress_follows_from_displacement_by_hookes_law_and_is_in_equilibrium(poisson, points):
    """Of a point load; that of a rectangle is the sum of its points."""
    of_u = gradient(lambda x: displacement(point_load(*x), 1.0, poisson), points)
    strain = 0.5 * (of_u.transpose(0, 2, 1) + of_u.transpose(2, 0, 1))
    lam, mu = lame_parameters(1.0, poisson)
    law = 2.0 * mu * strain + lam * np.einsum("aak->k", strain) * np.eye(3)[:, :, None]
    # lambda grows as 1 / (1 - 2 nu) and with it the rounding of the differences: 1e-12 / STEP * 1700
    tolerance = DIFFERENCE if poisson < 0.49 else 2e-3
    np.testing.assert_allclose(stress(point_load(*points), poisson), law, atol=tolerance * np.abs(law).max())
    of_sigma = gradient(lambda x: stress(point_load(*x), poisson), points)
    assert np.abs(np.einsum("abkb->ak", of_sigma)).max() < DIFFERENCE * np.abs(of_sigma).max()


def test_surface_carries_the_pressure_and_nothing_else():
    x, y = np.meshgrid(np.linspace(-0.61, 0.6, 7), np.linspace(-0.33, 0.34, 5))
    zero = np.zeros_like(x)
    inside = stress(rectangle_load(x, y, zero, *SIDES), 0.3)
    np.testing.assert_allclose(inside[2, 2], -1.0, atol=1e-12)
    np.testing.assert_allclose(inside[2, :2], 0.0, atol=1e-12)
    outside = stress(rectangle_load(x + 2.0, y, zero, *SIDES), 0.3)
    np.testing.assert_allclose(outside[2], 0.0, atol=1e-12)


@pytest.mark.parametrize("poisson", POISSON)
def test_rectangle_is_the_sum_of_its_points(poisson, points):
    place, weight = np.polynomial.legendre.leggauss(30)
    x, y = 0.5 * SIDES[0] * place[:, None], 0.5 * SIDES[1] * place
    area = np.outer(weight, weight) * 0.25 * SIDES[0] * SIDES[1]
    for place in points.T[:5]:
        one = point_load(*np.broadcast_arrays(place[0] - x, place[1] - y, place[2]))
        whole = rectangle_load(*(np.array([c]) for c in place), *SIDES)
        np.testing.assert_allclose(
            displacement(whole, 1.0, poisson)[:, 0], (displacement(one, 1.0, poisson) * area).sum((1, 2)), atol=1e-12
        )
        np.testing.assert_allclose(
            stress(whole, poisson)[..., 0], (stress(one, poisson) * area).sum((2, 3)), atol=1e-12
        )


def test_surface_displacement_of_the_point_load():
    """Boussinesq: u_z = (1 - nu^2) P / (pi E r), Johnson (1985), section 3.2."""
    r = np.array([0.3, 1.0, 5.0])
    u = displacement(point_load(r, 0.0 * r, 0.0 * r), 2.5, 0.3)
    np.testing.assert_allclose(u[2], (1.0 - 0.3**2) / (np.pi * 2.5 * r), rtol=1e-14)
    np.testing.assert_allclose(u[0], -(1.0 + 0.3) * (1.0 - 2.0 * 0.3) / (2.0 * np.pi * 2.5 * r), rtol=1e-14)
