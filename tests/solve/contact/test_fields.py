import numpy as np
import pytest

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from solve.contact.fields import fruit_fields
from solve.contact.pressure import FootprintPressure, footprint_pressure
from solve.contact.scene import Scene
from solve.fruit.split import split_compliance
from solve.halfspace.punch import graded_edges

BLOCK = Fruit(poisson=0.3)
C = np.diag([1.0 / 0.9057, 1.0 / 20.831])
E, X = 2.0, 0.6


@pytest.fixture(scope="module")
def pressed():
    tips = Tips()
    return footprint_pressure(Scene(fruit=BLOCK, tips=tips, press=Press()), split_compliance(BLOCK, tips), C, E, X)


@pytest.fixture(scope="module")
def fields(pressed):
    return fruit_fields(BLOCK, pressed)


def indentations(pressed):
    """Return how deep the tips are in the fruit: the travel less what their springs give [mm]."""
    return X - C @ pressed.forces


def test_faces_go_down_by_their_indentation(fields, pressed):
    """Patches of uniform pressure stand for the cells: ripples of some per cent beneath them."""
    mesh, found = fields
    x, y, z = mesh.p
    for centre, indentation in zip(pressed.centres[:, 0], indentations(pressed), strict=True):
        under = (np.abs(x - centre) < 0.45) & (np.abs(y) < 0.45) & (z > -1e-9)
        assert under.sum() > 20
        np.testing.assert_allclose(-found.displacement[under, 2], indentation, rtol=0.03)


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


def test_surface_beside_the_tips_is_free_and_under_them_carries_the_pressure(fields, pressed):
    """Boundary condition of the pressed half-space; the remainder leaves what its mesh does not resolve."""
    mesh, found = fields
    x, y, z = mesh.p
    top = z == 0.0
    away = np.min([np.maximum(np.abs(x - centre), np.abs(y)) for centre in pressed.centres[:, 0]], axis=0)
    largest = np.abs(found.stress).max()
    assert np.abs(found.stress[2, :, top & (away > 0.6)]).max() < 1e-2 * largest
    middle = top & (np.hypot(x - pressed.centres[1, 0], y) < 0.3)
    mean = pressed.forces[1] / 1.0**2
    assert (found.stress[2, 2, middle] < -0.4 * mean).all()
