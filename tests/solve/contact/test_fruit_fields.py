import numpy as np
import pytest

from sensor.design.fruit import Fruit
from solve.contact.fruit_fields import fruit_fields
from solve.contact.pressure import FootprintPressure
from solve.halfspace.punch import graded_edges


def hertz(radius=0.1, largest=1.0, cells=24):
    """Return the pressure of Hertz on both feet, far apart on a large block."""
    edges = 2.0 * radius * graded_edges(cells, 1.0)
    middle = 0.5 * (edges[1:] + edges[:-1])
    r2 = (middle[:, None] ** 2 + middle**2) / radius**2
    one = largest * np.sqrt(np.maximum(1.0 - r2, 0.0))
    forces = one * np.multiply.outer(np.diff(edges), np.diff(edges))
    return FootprintPressure(
        E=1.0,
        centres=np.array([[-10.0, 0.0], [10.0, 0.0]]),
        edges=edges,
        cell_forces=np.stack([forces, forces]),
    )


@pytest.mark.slow
def test_stress_under_hertz_pressure_is_that_of_the_closed_form_at_every_depth():
    """On the axis, Johnson (1985), equations 3.45; largest, 0.62 p_0, at 0.48 a, between two nodes here."""
    a, nu = 0.1, 0.3
    block = Fruit(length_mm=40.0, width_mm=20.0, height_mm=20.0, poisson=nu)
    mesh, found = fruit_fields(block, hertz(radius=a))
    x, y, z = mesh.p
    axis = np.flatnonzero((np.hypot(x - 10.0, y) < 0.07 * a) & (z < 0.0) & (z > -4.0 * a))
    assert len(axis) >= 4
    depth = -z[axis] / a
    along = -1.0 / (1.0 + depth**2)
    across = -(1.0 + nu) * (1.0 - depth * np.arctan(1.0 / depth)) + 0.5 / (1.0 + depth**2)
    np.testing.assert_allclose(found.stress[2, 2, axis], along, rtol=0.02)  # twelve patches over the circle
    np.testing.assert_allclose(found.von_mises[axis], np.abs(along - across), rtol=0.02)
    assert found.von_mises.max() == found.von_mises[axis].max() < 0.63
    # Beside the circles the surface is free, but for what the mesh of the remainder does not resolve.
    beside = (z == 0.0) & (np.hypot(x - 10.0, y) > 1.5 * a) & (np.hypot(x + 10.0, y) > 1.5 * a)
    assert beside.sum() > 20
    assert np.abs(found.stress[2][:, beside]).max() < 1e-2
    # Each circle sinks by pi p_0 a / (2 E*): Johnson, equation 3.41a.
    middle = np.flatnonzero((z == 0.0) & (np.hypot(x - 10.0, y) < 0.07 * a))
    sunk = -found.displacement[middle, 2]
    np.testing.assert_allclose(sunk, 0.5 * np.pi * a * (1.0 - nu**2), rtol=0.02)
