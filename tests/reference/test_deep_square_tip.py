"""A square tip in three dimensions against the round one that stands for it, both glued and without a side wall."""

import numpy as np
import pytest
from reference.deep_square_tip import MESHES, QuarterBlock, Sizes, round_factors, square_forces

TINY = Sizes(edge=0.25, growth=3.0)


def test_forces_and_tangent_are_derivatives(rng):
    """The tangent is the slope of the forces, at a stretch that is nearly uniform."""
    body = QuarterBlock(TINY, 0.3)
    u = (body.places.T * [0.1, 0.05, 0.3]).ravel() + 1e-3 * rng.standard_normal(3 * body.places.shape[1])
    way, step = rng.standard_normal(len(u)), 1e-6
    slope = (body.forces(u + step * way) - body.forces(u - step * way)) / (2.0 * step)
    found = body.tangent(u) @ way
    np.testing.assert_allclose(found, slope, rtol=1e-5, atol=1e-5 * np.abs(slope).max())


@pytest.mark.study
def test_square_tip_is_that_of_the_circle_of_equal_area_within_one_per_cent():
    """Measured: 0.1 % at edge elements of 0.12 sides; docs/accuracy.md has finer ones."""
    depths = (0.05, 0.1)
    stiffness, forces, _ = square_forces(0.3, depths, MESHES[0])
    found = forces / (stiffness * np.array(depths))
    np.testing.assert_allclose(found, round_factors(0.3, depths, MESHES[0]), rtol=0.01)
