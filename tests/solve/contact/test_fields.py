import dataclasses

import numpy as np
import pytest

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from solve.contact.fields import fruit_fields
from solve.contact.pressure import FootprintPressure, footprint_pressure
from solve.contact.scene import Scene
from solve.elasticity import von_mises
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


def test_mesh_is_the_block_under_its_top(fields):
    np.testing.assert_allclose(fields.mesh.p.min(axis=1), [-10.0, -10.0, -12.0], atol=1e-12)
    np.testing.assert_allclose(fields.mesh.p.max(axis=1), [10.0, 10.0, 0.0], atol=1e-12)
    assert fields.displacement.shape == fields.mesh.p.T.shape
    assert fields.von_mises.shape == (fields.mesh.t.shape[1],)
    assert set(fields.mesh.boundaries) == {"top", "base"}


def test_faces_go_down_by_their_indentation(fields, pressed):
    """Patches of uniform pressure stand for the cells: ripples of some per cent beneath them."""
    x, y, z = fields.mesh.p
    for centre, indentation in zip(pressed.centres[:, 0], indentations(pressed), strict=True):
        under = (np.abs(x - centre) < 0.45) & (np.abs(y) < 0.45) & (z > -1e-9)
        assert under.sum() > 20
        np.testing.assert_allclose(-fields.displacement[under, 2], indentation, rtol=0.03)


def test_base_is_clamped_and_the_far_field_small(fields, pressed):
    base = fields.mesh.boundaries["base"]
    nodes = np.unique(fields.mesh.facets[:, base])
    assert np.abs(fields.displacement[nodes]).max() < 1e-3 * indentations(pressed).max()
    middles = fields.mesh.p[:, fields.mesh.t].mean(axis=1)
    low = middles[2] < -6.0
    assert fields.von_mises[low].max() < 0.05 * fields.von_mises.max()


def test_energy_of_distortion_is_most_of_the_work_of_the_tips(fields, pressed):
    """Energy int q^2 / 6 G over the fruit is what the work F d / 2 of both tips leaves after the change of volume."""
    corners = fields.mesh.p[:, fields.mesh.t]
    volume = np.prod(corners.max(axis=1) - corners.min(axis=1), axis=0)
    shear = E / 2.6
    distortion = (fields.von_mises**2 * volume).sum() / (6.0 * shear)
    work = 0.5 * pressed.forces @ indentations(pressed)
    assert 0.4 * work < distortion < work


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


def test_largest_stress_under_hertz_pressure_lies_below_the_surface():
    """0.62 p_0 at 0.48 a on the axis for nu = 0.3: Johnson (1985), section 4.2."""
    block = Fruit(length_mm=40.0, width_mm=20.0, height_mm=20.0, poisson=0.3)
    found = fruit_fields(block, hertz())
    worst = int(found.von_mises.argmax())
    place = found.mesh.p[:, found.mesh.t[:, worst]].mean(axis=1)
    # cells of a quarter of the radius sample the maximum within some per cent
    assert found.von_mises[worst] == pytest.approx(0.62, rel=0.06)
    assert -place[2] / 0.1 == pytest.approx(0.48, abs=0.15)
    assert abs(abs(place[0]) - 10.0) < 0.03


def test_far_from_the_tips_the_field_is_that_of_point_forces():
    """Boussinesq below the load: u_z = F (1 + nu) (3 - 2 nu) / (2 pi E z); the block's size changes it by a / H."""
    block = Fruit(length_mm=400.0, width_mm=400.0, height_mm=400.0, poisson=0.3)
    pressure = dataclasses.replace(hertz(), cell_forces=hertz().cell_forces * np.array([0.0, 1.0])[:, None, None])
    found = fruit_fields(block, dataclasses.replace(pressure, centres=np.array([[-10.0, 0.0], [0.0, 0.0]])))
    x, y, z = found.mesh.p
    axis = (np.hypot(x, y) < 0.05 * -z) & (z < -0.5) & (z > -4.0)
    assert axis.any()
    expected = pressure.forces[1] * 1.3 * 2.4 / (2.0 * np.pi * -z[axis])
    np.testing.assert_allclose(-found.displacement[axis, 2], expected, rtol=0.03)


def test_modulus_scales_displacement_and_not_stress(pressed, fields):
    softer = fruit_fields(BLOCK, dataclasses.replace(pressed, E=0.5 * E))
    np.testing.assert_allclose(softer.displacement, 2.0 * fields.displacement, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(softer.von_mises, fields.von_mises, rtol=1e-12)


def test_von_mises_of_plain_states():
    assert von_mises(np.diag([2.0, 0.0, 0.0])) == pytest.approx(2.0)
    assert von_mises(np.eye(3)) == pytest.approx(0.0, abs=1e-15)
    assert von_mises(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])) == pytest.approx(np.sqrt(3.0))
