"""Domes on springs: exact for one, symmetric for four, and as contact cells find them where slopes are small."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq, root
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipk

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.theory.contrast_law import ContrastLaw, contrast_weights, read_modulus
from solve.contact.domes.fruit_under_domes import FruitUnderDomes, fruit_under_domes
from solve.contact.domes.geometry import DomePoses, dome_poses
from solve.contact.domes.large_strain import large_strain
from solve.contact.domes.law import (
    DEPTH_FRACTION,
    MOVED_CONTACT_FACTOR,
    VARIATION_OVER_CONTACT,
    dome_contrast,
    dome_forces,
)
from solve.contact.scene import LateralCompliance, Scene
from solve.contact.scene_cells import scene_cells
from solve.contact.unilateral import UnilateralContact
from solve.fruit.split import split_compliance
from solve.halfspace.layered import Layer, base_compliance, round_contact
from solve.linear import SolveError

POISSON, DOME = 0.3, 2.0
E = np.array([1.0, 3.5])
FLAT = np.full((2, 3), np.inf)
SPRINGS = np.diag([1.0 / 1.2, 1.0 / 20.0, 1.0 / 1.2, 1.0 / 20.0])
# Slopes a fifth of those of a mango: what contact cells leave out, their squares, is 25 times smaller.
BLUNT = Fruit(shape="sphere", radius_mm=175.0, thickness_mm=12.0, length_mm=50.0, width_mm=50.0)
GENTLE = Tips(layout="square", shape="dome", dome_radius_mm=50.0, side_mm=5.8, spacing_mm=6.0)
TRAVEL = 0.08


def half_space(count=1, poses=2, **changes):
    none = np.zeros((poses, count, count))
    given = {
        "poisson": POISSON,
        "remainder": none,
        "bound": none,
        "boundary_distance": np.inf,
        "contact_points": np.zeros((count, 2)),
    }
    return FruitUnderDomes(**{**given, **changes})


def plane_face_test(q, modulus):
    """Return the force [N] of one dome that is pressed by q [mm] into a plane, by Hertz and large strain."""
    strain = large_strain(np.sqrt(DOME * np.array(q)), DOME, np.array(0.0), POISSON)
    return float(strain.factor) * modulus / (1.0 - POISSON**2) * 4.0 / 3.0 * np.sqrt(DOME) * q**1.5


def lowered(places, depth):
    """Return level domes over a plane that would enter it by a depth, the same in two poses."""
    centres = np.column_stack([places, np.full(len(places), DOME - depth)])
    return DomePoses(DOME, np.stack([centres, centres]), np.tile(np.eye(3), (2, 1, 1)), FLAT)


def test_one_dome_on_a_rigid_spring():
    """Hertz's force by large strain, and the slope that belongs to it, at the given depth."""
    a, modulus = 0.9, E / (1.0 - POISSON**2)
    depth = a**2 / DOME
    found = dome_forces(lowered([[0.0, 0.0]], depth), E, np.zeros((1, 1)), half_space())
    strain = large_strain(np.array(a), DOME, np.array(0.0), POISSON)
    expected = strain.factor * modulus * 4.0 / 3.0 * a**3 / DOME
    np.testing.assert_allclose(found.F[:, 0], expected, rtol=1e-9)
    np.testing.assert_allclose(found.contact_radius, a * strain.edge, rtol=1e-9)
    np.testing.assert_allclose(found.mean_pressure[:, 0], expected / (np.pi * (a * strain.edge) ** 2), rtol=1e-9)
    np.testing.assert_allclose(found.pressure_error, 2.0 * strain.edge_error, rtol=1e-12)
    rim = found.face / 2.0  # of a sphere with its own profile, at the same depth
    np.testing.assert_allclose(rim * np.arctanh(rim / DOME), depth, rtol=1e-9)
    deeper = dome_forces(lowered([[0.0, 0.0]], depth + 1e-6), E, np.zeros((1, 1)), half_space())
    np.testing.assert_allclose(found.rates, (deeper.F - found.F) / 1e-6, rtol=1e-5)
    np.testing.assert_allclose(found.flesh[:, 0], strain.law_spread * expected / strain.factor, rtol=0.05)


def test_dome_on_a_skin_is_at_small_strain_with_all_of_the_large_one_open():
    skin = round_contact(Layer(thickness=0.3, modulus=10.0, poisson=POISSON, poisson_below=POISSON), DOME)
    depth = 0.2
    contact, force, _ = skin.press(np.array(DOME * depth))
    found = dome_forces(lowered([[0.0, 0.0]], depth), E, np.zeros((1, 1)), half_space(skin_contact=skin))
    np.testing.assert_allclose(found.F[:, 0], E * force / DOME, rtol=1e-9)
    np.testing.assert_allclose(found.contact_radius, contact, rtol=1e-9)
    bare = large_strain(contact, DOME, np.array(0.0), POISSON)
    np.testing.assert_allclose(found.pressure_error, 2.0 * abs(bare.edge - 1.0), rtol=1e-9)
    assert np.all(found.error >= abs(bare.factor - 1.0) * found.F)


def test_one_dome_on_an_ellipsoid_is_the_elliptic_contact_of_hertz():
    """Johnson (1985), equations (4.24), (4.28) and (4.31), with elliptic integrals; the law is good to 0.1 %."""
    dome, depth, axes = 20.0, 0.1, np.array([40.0, 20.0, 40.0])
    low, high = 1.0 / dome + 1.0 / axes[0], 1.0 / dome + axes[0] / axes[1] ** 2  # relative curvatures at the apex
    m = brentq(lambda m: (ellipe(m) / (1.0 - m) - ellipk(m)) / (ellipk(m) - ellipe(m)) - high / low, 1e-6, 1.0 - 1e-6)
    shape = (ellipe(m) / (1.0 - m) - ellipk(m)) * (ellipk(m) - ellipe(m))
    F1 = (4.0 / (np.pi * m) * (1.0 - m) ** 0.75 * np.sqrt(shape)) ** (1.0 / 3.0)
    F2 = 2.0 / np.pi * (1.0 - m) ** 0.25 * ellipk(m) / F1
    expected = 4.0 / 3.0 / (1.0 - POISSON**2) * (low * high) ** -0.25 * (depth / F2) ** 1.5
    poses = DomePoses(dome, np.array([[[0.0, 0.0, dome - depth]]]), np.eye(3)[None], axes[None])
    found = dome_forces(poses, np.ones(1), np.zeros((1, 1)), half_space(poses=1))
    hertz = np.sqrt(depth / np.sqrt(low * high))
    large = large_strain(hertz, dome, np.sqrt(low * high) - 1.0 / dome, POISSON)
    assert found.F[0, 0] == pytest.approx(expected * float(large.factor), rel=1e-3)


def test_small_domes_settle_on_the_largest_fruit():
    """As on a plane, but for the fall of the fruit: a centre 1 m away costs digits, but hides no equilibrium."""
    dome, radius, poses = 0.02, 1000.0, 50
    depth = np.linspace(0.001, 0.005, poses)
    centres = np.zeros((poses, 2, 3))
    centres[..., 0] = [-0.035, 0.035]
    centres[..., 2] = dome - depth[:, None]
    forces = []
    for axes in ((radius, 0.8 * radius, radius), (np.inf, np.inf, np.inf)):
        standing = DomePoses(dome, centres, np.tile(np.eye(3), (poses, 1, 1)), np.tile(axes, (poses, 1)))
        forces.append(dome_forces(standing, np.ones(poses), np.diag([10.0, 1.0]), half_space(2, poses)).F)
    fall = 0.035**2 / (2.0 * radius)
    np.testing.assert_allclose(forces[0], forces[1], rtol=1.6 * fall / depth.min())  # forces go with depth^1.5


def test_dome_that_is_off():
    """It hangs 0.1 mm over the plane beside one that is pressed, without force and error."""
    poses = lowered([[0.0, 0.0], [20.0, 0.0]], np.array([0.1, -0.1]))
    found = dome_forces(poses, E, np.diag([0.1, 0.1]), half_space(2, bound=np.full((2, 2, 2), 1e-3)))
    np.testing.assert_array_equal(found.F[:, 1], 0.0)
    np.testing.assert_array_equal(found.relative_error[:, 1], 0.0)
    np.testing.assert_allclose(found.relative_error[:, 0], found.error[:, 0] / found.F[:, 0], rtol=1e-12)
    assert np.all(found.relative_error[:, 0] > 0.0)
    for values in (found.rates, found.mean_pressure, found.pressure_error, found.face):
        np.testing.assert_array_equal(values[:, 1], 0.0)
        assert np.all(values[:, 0] > 0.0)


def test_error_of_one_dome():
    """Its slope times what is left out: of the body where and as wide as it touches, of the depth, of large strain.

    The dome stands 1.5 mm beside where the body was solved, on a soft spring.
    """
    B, b, size, depth, spring = 0.05, 2e-3, 9.0, 0.4, 0.3
    one = np.ones((2, 1, 1))
    body = half_space(remainder=B * one, bound=b * one, boundary_distance=size, contact_points=np.array([[2.0, 0.0]]))
    found = dome_forces(lowered([[3.5, 0.0]], depth), E, np.array([[spring]]), body)
    for i, modulus in enumerate(E.tolist()):
        q = brentq(lambda q, E=modulus: q + (B / E + spring) * plane_face_test(q, E) - depth, 1e-6, depth, xtol=1e-14)
        N, slope = (
            plane_face_test(q, modulus),
            (plane_face_test(q + 1e-6, modulus) - plane_face_test(q - 1e-6, modulus)) / 2e-6,
        )
        strain = large_strain(np.sqrt(DOME * np.array(q)), DOME, np.array(0.0), POISSON)
        growth = 1.5 * (1.5 + 2.0 * 2.0) / size**2
        left_out = b + VARIATION_OVER_CONTACT * B * DOME * q / size**2 + MOVED_CONTACT_FACTOR * growth * B
        bound = left_out * N / modulus + DEPTH_FRACTION * q + float(strain.error) * N / slope
        assert found.F[i, 0] == pytest.approx(N, rel=1e-9)
        rate = slope / (1.0 + (B / modulus + spring) * slope)
        assert found.rates[i, 0] == pytest.approx(rate, rel=1e-6)
        assert found.error[i, 0] == pytest.approx(rate * bound, rel=1e-6)
        assert found.common_error[i, 0] == pytest.approx(found.error[i, 0], rel=1e-12)


def test_crosstalk_of_near_domes():
    """At 3 mm its moments count: k = (1 - nu^2) / (pi p) (1 + a_i^2 / (6 p^2) + a_j^2 / (10 p^2)), on a level pair.

    The slope under one, N times that of k, moves its contact by the radius times that slope away from the other.
    """
    apart, depth = 3.0, 0.3
    found = dome_forces(lowered([[0.0, 0.0], [apart, 0.0]], depth), E, np.zeros((2, 2)), half_space(2))

    def missing(q, modulus):
        N = plane_face_test(q, modulus)
        normal = (1.0 - POISSON**2) / np.pi
        shift = DOME * normal * N / modulus / apart**2
        p = apart + 2.0 * shift
        k = normal / p * (1.0 + DOME * q * (1.0 / 6.0 + 1.0 / 10.0) / p**2)
        return depth - q - k * N / modulus - 0.5 * shift**2 / DOME, N

    for i, modulus in enumerate(E.tolist()):
        q = brentq(lambda q, E=modulus: missing(q, E)[0], 1e-6, depth, xtol=1e-14)
        assert found.F[i] == pytest.approx([missing(q, modulus)[1]] * 2, rel=1e-9)


@cache
def compliance(fruit, tips):
    """Return that of the equivalent block: the shape of a blunt fruit changes nothing that these tests see."""
    return split_compliance(fruit, tips, 1e-4)


def scene(tilt=0.0, roll=0.0, fruit=BLUNT, tips=GENTLE, travel=TRAVEL):
    return Scene(fruit=fruit, tips=tips, press=PressMotion(travel_mm=travel, tilt_deg=tilt, roll_deg=roll))


def pressed(posed, modulus=1.0, springs=SPRINGS):
    known = compliance(posed.fruit, posed.tips)
    poses = dome_poses([posed], np.array([posed.press.travel_mm]))
    return dome_forces(poses, np.array([modulus]), springs, fruit_under_domes(posed, known, [posed.fruit]))


@pytest.mark.slow
def test_contact_cells_find_the_same_forces():
    """Within both bars: the law's, and twice the step from the coarse to the fine cells."""
    posed = scene(0.4, 0.3)
    coarse, fine = scene_cells(posed, compliance(BLUNT, GENTLE), TRAVEL)
    for modulus in (0.5, 3.5):
        cells = [
            modulus
            * UnilateralContact(grid.cells)
            .solve(grid.interference(posed, TRAVEL), modulus * SPRINGS + grid.compliance_correction)
            .F
            for grid in (coarse, fine)
        ]
        found = pressed(posed, modulus)
        assert np.all(
            np.abs(found.F[0] - cells[1]) < found.error[0] + 2.0 * np.abs(cells[1] - cells[0]) + 1e-3 * cells[1]
        )


@pytest.mark.parametrize("modulus", [0.5, 3.5])
def test_forces_that_lean_against_a_direct_solve(modulus):
    """Two domes far apart on a ball of 400 mm, in a sensor that is turned, on springs coupled in all directions.

    Six coordinates of two centres, each moved by all six springs under forces along the normals. Of the crosstalk 1 / p
    is in it; its moments and slopes are below (a / p)^2 = 1e-4 of it, 1e-6 of the forces.
    """
    ball, dome, reduced = 400.0, 10.0, modulus / (1.0 - POISSON**2)
    radius = 1.0 / (1.0 / ball + 1.0 / dome)
    coupled = np.diag([0.6, 0.4, 0.8, 0.1, 0.2, 0.3]) + 0.3 * 0.7 ** np.abs(np.subtract.outer(range(6), range(6)))
    frame = Rotation.from_euler("xy", [0.1, 0.2]).as_matrix()
    turned = np.kron(np.eye(2), frame)
    feet = np.array([[-0.25, 0.05, 0.97], [0.29, -0.1, 0.95]])
    feet /= np.linalg.norm(feet, axis=1, keepdims=True)
    centres = (ball + dome - np.array([[0.5], [0.7]])) * feet - [0.0, 0.0, ball]

    def normals(moved):
        from_middle = moved + np.array([0.0, 0.0, ball])
        away = np.linalg.norm(from_middle, axis=1)
        return from_middle / away[:, None], away

    def unbalanced(state):
        moved, N = state[:6].reshape(2, 3), state[6:]
        normal, away = normals(moved)
        depth = ball + dome - away - N[::-1] / (np.pi * reduced * ball * np.linalg.norm(normal[0] - normal[1]))
        contact = np.sqrt(radius * np.maximum(depth, 0.0))
        factor = large_strain(contact, dome, np.full(2, 1.0 / ball), POISSON).factor
        given = turned.T @ coupled @ turned @ (N[:, None] * normal).ravel()
        sunk = (0.75 * np.maximum(N, 0.0) / (factor * reduced * np.sqrt(radius))) ** (2.0 / 3.0)
        return np.concatenate([(centres - moved).ravel() + given, depth - sunk])

    # on the way up no dome must leave the ball
    start = centres.ravel() + 0.1 * turned.T @ [0, 0, 1, 0, 0, 1]
    solved = root(unbalanced, [*start, 0.2, 0.2], tol=1e-13)
    assert solved.success
    expected = solved.x[6:] * (normals(solved.x[:6].reshape(2, 3))[0] @ frame[2])

    sideways = coupled.reshape(2, 3, 2, 3).transpose(0, 2, 1, 3).copy()
    along = sideways[..., 2, 2].copy()
    sideways[..., 2, 2] = 0.0
    poses = DomePoses(dome, centres[None], frame[None], np.full((1, 3), ball), LateralCompliance(sideways, 0.01))
    body = half_space(2, poses=1)
    found, straight = (
        dome_forces(one, np.array([modulus]), along, body) for one in (poses, dataclasses.replace(poses, sideways=None))
    )
    np.testing.assert_allclose(found.F[0], expected, rtol=3e-6)
    assert np.all(np.abs(straight.F / found.F - 1.0) > 0.01)  # what is tested is far above the tolerance
    # the error of the give is in that of the forces
    assert np.all(found.error > straight.error)


MANGO = dataclasses.replace(BLUNT, radius_mm=35.0, length_mm=30.0, width_mm=30.0)


def level_domes(sideways=None):
    tips = dataclasses.replace(GENTLE, dome_radius_mm=10.0)
    return dataclasses.replace(scene(fruit=MANGO, tips=tips, travel=0.4), sideways=sideways)


def contrast_of(level):
    tips = level.tips
    found = dome_contrast(level, compliance(level.fruit, tips), SPRINGS, 1.0)
    return ContrastLaw(
        weights=contrast_weights(tips.places_mm, tips.springs),
        gaps=(0.0,) * 4,
        C=(SPRINGS + found.inclination_compliance).tolist(),
        S=found.S.tolist(),
        hertz=found.hertz,
    )


def test_contrast_is_refused_where_a_dome_is_off_at_full_travel():
    """On a ball the middle tip of a line touches first: at less travel than the outer ones fall, these are off."""
    level = level_domes()
    tips = dataclasses.replace(level.tips, layout="line", order="LHL", outer_mm=0.0)
    travel = 0.5 * level.fruit.fall_mm(*tips.places_mm[0])
    shallow = dataclasses.replace(level, tips=tips, press=dataclasses.replace(level.press, travel_mm=travel))
    with pytest.raises(SolveError):
        dome_contrast(shallow, compliance(level.fruit, tips), SPRINGS[:3, :3], 1.0)


def test_contrast_reads_the_modulus_of_domes_that_give_sideways_too():
    """What the give moves the reading by where it is left out shrinks to a tenth: its second order."""
    give = np.zeros((4, 4, 3, 3))
    give[[1, 3], [1, 3], 1, 1] = 0.5
    stiff, soft = level_domes(), level_domes(LateralCompliance(give, 0.0))
    for modulus in (1.0, 3.5):
        forces = pressed(soft, modulus).F[0].tolist()
        expected = read_modulus(contrast_of(stiff), pressed(stiff, modulus).F[0].tolist())
        assert expected == pytest.approx(modulus, rel=0.02)
        left_out = read_modulus(contrast_of(stiff), forces) / expected - 1.0
        taken = read_modulus(contrast_of(soft), forces) / expected - 1.0
        assert left_out < -1e-3
        assert abs(taken) < 0.1 * abs(left_out)


def test_other_radius_bends_the_body_in_proportion_and_widens_the_bound():
    known = dataclasses.replace(compliance(BLUNT, GENTLE), shape_change=np.full((4, 4), 1e-3))
    fruits = [dataclasses.replace(BLUNT, radius_mm=radius) for radius in (175.0, 140.0, 210.0)]
    body = fruit_under_domes(scene(), known, fruits)
    changed = body.remainder - body.remainder[0]
    np.testing.assert_allclose(changed[1:, 0, 0], [0.25e-3, -1e-3 / 6.0], rtol=1e-9)
    assert np.all(body.bound[1:] > body.bound[0])


def test_other_thickness_changes_the_compliance_by_the_base_at_the_distance_of_the_tips():
    fruits = [BLUNT, dataclasses.replace(BLUNT, thickness_mm=0.5 * BLUNT.depth_mm)]
    body = fruit_under_domes(scene(), compliance(BLUNT, GENTLE), fruits)
    first, second = body.contact_points[:2]
    distances = np.array([0.0, np.linalg.norm(first - second)])
    thin, thick = (base_compliance(fruit.depth_mm, BLUNT.poisson, distances) for fruit in reversed(fruits))
    np.testing.assert_allclose((body.remainder[1] - body.remainder[0])[0, :2], thin - thick, rtol=1e-7)
    assert np.all(body.bound[1] > body.bound[0])
