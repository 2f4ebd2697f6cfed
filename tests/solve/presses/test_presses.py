"""The boundary elements of presses on ellipsoids: Hertz, another program's forces, symmetries, and refinement."""

import math
from dataclasses import replace

import numpy as np
import pytest
from layer_equations import bonded
from scipy.special import j0
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, LinearForm, MeshQuad, asm, condense, solve
from skfem.helpers import ddot, grad, sym_grad, trace
from stored_presses import STORED, square

from solve.presses.press_over_time import PressMotionOverTime, fit_kelvin_elements, press_over_time, press_with_creep
from solve.presses.pressed_bodies import EllipsoidFruit, FleshOnStone, OuterLayer, SprungDomes
from solve.presses.pressing import Pressing, press

LEVEL = EllipsoidFruit(E=1.0, R1=45.0, R2=100.0)
OTHERS = STORED["presses"]
MARKS = {0: (), 3: pytest.mark.slow, 5: pytest.mark.slow}  # a level one, a tilted one, a ball


def alone(K=1e9, dome_radius=10.0, **form):
    return SprungDomes(dome_radius=dome_radius, positions=np.zeros((1, 2)), K=np.array([K]), **form)


def hertz_error(cells):
    """Return by how much a single rigid dome on a flat fruit is stiffer than in Hertz's formula [1]."""
    dome = alone(dome_radius=1000.0)
    fruit = EllipsoidFruit(E=1.0, R1=1e9, R2=1e9)
    depths = np.geomspace(1e-3, 2e-3, 7)
    found = press(dome, fruit, depths, cells)[:, 0]
    exact = 4.0 / 3.0 / (1.0 - fruit.poisson**2) * math.sqrt(1000.0) * depths**1.5
    return found / exact - 1.0


def test_one_dome_presses_as_hertz_says():
    """The error of cells at the edge falls faster than their size: 0.2 % at 16, 0.03 % at 32, 0.01 % at 64."""
    assert np.abs(hertz_error(32)).max() < 6e-4
    assert np.abs(hertz_error(64)).max() < 1.2e-4


def test_a_flat_dome_presses_as_far_as_its_rim():
    """A flat round face: F = 2 E* a d (I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47), by squares of 0.08 a."""
    force = press(alone(dome_radius=1e6, rim=2.0), EllipsoidFruit(E=1.0, R1=1e9, R2=1e9), [0.05])[0, 0]
    assert force == pytest.approx(2.0 / 0.91 * 2.0 * 0.05, rel=0.02)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=f"{case['E']}-{case['R1']}-{case['R2']}", marks=MARKS.get(number, pytest.mark.study))
        for number, case in enumerate(OTHERS)
    ],
)
def test_other_boundary_elements_give_the_same_forces(case):
    """Theirs converge to 0.2 % (level) and 0.5 % (tilted), small forces to as much of the largest."""
    fruit = EllipsoidFruit(**{key: case[key] for key in ("E", "R1", "R2", "azimuth", "tilt", "tilt_azimuth")})
    theirs = np.array(case["forces"])[19::5]
    ours = press(square(), fruit, case["travel"][19::5])
    allowed = 0.005 if case["tilt"] else 0.002
    assert ours == pytest.approx(theirs, rel=allowed, abs=allowed * theirs.max())
    assert ours[-1] == pytest.approx(theirs[-1], rel=allowed)


SIDE = 0.05 * (square().positions[:, 0] > 0.0)
ALIKE = [
    ({"bumps": lambda x, y: -0.5 * (x**2 / 60.0 + y**2 / 90.0)}, {"R1": 180.0 / 7.0, "R2": 900.0 / 19.0}),
    ({"bumps": lambda x, y: 0.02 * x - 0.01 * y}, {"tilt": 1.281044, "tilt_azimuth": -26.56505}),
    ({"bumps": lambda x, y: 0.0 * x * y + 0.3}, {}),
    ({"bumps": lambda x, y: 0.05 * (x + 0.0 * y > 0.0)}, {"heights": SIDE}),
    ({"apex": (-2.0, 0.0)}, {"tilt": math.degrees(math.atan(2.0 / 45.0)), "tilt_azimuth": 180.0}),
    ({"softness": (2.0,) * 4}, {"layer": OuterLayer(1e-6, 1.0), "softness": (2.0,) * 4}),
    ({"layer": OuterLayer(2.0, 1.0)}, {}),
    ({"layer": FleshOnStone(4000.0)}, {}),
    ({"yields": 100.0}, {}),
]


@pytest.mark.parametrize(("one", "other"), ALIKE)
def test_fruits_that_are_told_by_other_fields_are_pressed_alike(one, other):
    """Paraboloids, tilts and heights of the skin are known by other fields; touches are found to 0.5 um of height."""
    ours, theirs = (press(square(), replace(LEVEL, **fields), [0.3, 0.7]) for fields in (one, other))
    assert ours == pytest.approx(theirs, rel=2e-3)


# R - sqrt(R^2 - s^2) of 10 mm less that of 8 mm
POINTED = alone(form=lambda s: 2.0 - np.sqrt(100.0 - s**2) + np.sqrt(64.0 - s**2))


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        ((alone(), replace(LEVEL, softness=(2.0,))), (alone(), replace(LEVEL, E=0.5))),
        (
            (alone(form=lambda s: 2.0 - np.sqrt(100.0 - s**2) + np.sqrt(64.0 - s**2)), LEVEL),
            (alone(dome_radius=8.0), LEVEL),
        ),
    ],
)
def test_soft_flesh_or_another_form_under_a_dome_alone(ours, theirs):
    assert press(*ours, [0.1, 0.3]) == pytest.approx(press(*theirs, [0.1, 0.3]), rel=5e-4)  # as `hertz_error` says


@BilinearForm
def axisymmetric_stiffness(u, v, w):
    """Return the bilinear form of elasticity for a body of revolution with E = `modulus`, per area of its meridian."""
    lam = w["poisson"] / ((1.0 + w["poisson"]) * (1.0 - 2.0 * w["poisson"]))
    mu = 0.5 / (1.0 + w["poisson"])
    hoop_u = u[0] / w.x[0]
    hoop_v = v[0] / w.x[0]
    strain = ddot(sym_grad(u), sym_grad(v)) + hoop_u * hoop_v
    dilatation = (trace(grad(u)) + hoop_u) * (trace(grad(v)) + hoop_v)
    return 2.0 * np.pi * w.x[0] * w["modulus"] * (2.0 * mu * strain + lam * dilatation)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("poisson", "softness"),
    [
        (0.3, 1.25),
        pytest.param(0.3, 2.0, marks=pytest.mark.study),
        pytest.param(0.45, 1.25, marks=pytest.mark.study),
        (0.45, 2.0),
    ],
)
def test_a_bruise_gives_way_as_a_soft_hemisphere_of_solids(poisson, softness):
    """A pressure on a disc of 1 mm over a bruise of 5 mm.

    The solids' own edge at 120 mm moves both depths by 1 %, and little their difference.
    """
    radius, edge = 5.0, 120.0
    lines = np.concatenate([np.linspace(0, 1, 7)[:-1], np.linspace(1, 6, 31)[:-1], np.geomspace(6, edge, 20)])
    mesh = MeshQuad.init_tensor(lines, -lines[::-1])
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=6)
    inside = np.hypot(*basis.global_coordinates()) < radius
    top = mesh.facets_satisfying(lambda x: (np.abs(x[1]) < 1e-9) & (x[0] < 1.0 + 1e-9))
    load = asm(LinearForm(lambda v, w: -2.0 * w.x[0] * v[1]), basis.boundary(top))
    held = np.concatenate([basis.get_dofs(lambda x: x[1] < 1e-6 - edge).all(),
                           basis.get_dofs(lambda x: x[0] < 1e-9).all("u^1")])  # fmt: skip
    depths = []
    for modulus in (np.ones_like(inside, dtype=float), np.where(inside, 1.0 / softness, 1.0)):
        stiffness = asm(axisymmetric_stiffness, basis, modulus=modulus, poisson=poisson)
        depths.append(load @ solve(*condense(stiffness, load, D=np.unique(held))))
    own, constant = replace(LEVEL, poisson=poisson, softness=(softness,), soft_radius=(radius,)).local_compliance[:, 0]
    compliance = (1.0 - poisson**2) / math.pi
    expected = own * depths[0] + constant * compliance
    # 3 % of the constant are 0.6 % of the depth
    assert depths[1] == pytest.approx(expected, abs=0.03 * abs(constant) * compliance)


def test_a_layer_on_stone_gives_way_as_published():
    """By its transform; then flesh on stone, the far field of a layer, and that of two."""
    t = np.array([0.01, 0.3, 1.0, 3.0])
    assert OuterLayer(1.0, 1e-9).compliance(t) == pytest.approx(bonded(t, 0.3), rel=1e-6)
    waves = np.linspace(1e-6, 12.0, 40001)
    for distance in (0.0, 6.3, 14.0):
        felt = np.trapezoid((bonded(waves, 0.3) - 1.0) * j0(waves * distance / 6.0), waves) / 6.0
        assert FleshOnStone(6.0).base_effect(distance) == pytest.approx(felt, rel=1e-4)
    for stiffness in (0.5, 2.0):
        layer = OuterLayer(2.0, stiffness)
        assert layer.compliance(np.array([0.0, 20.0])) == pytest.approx([stiffness, 1.0])
        waves = np.linspace(0.0, 15.0, 40001)
        at = np.trapezoid((layer.compliance(waves) - 1.0) * j0(1.5 * waves), waves) / (2.0 * stiffness)
        assert layer.base_effect(3.0) == pytest.approx(at, rel=1e-4)
        assert 60.0 * layer.base_effect(60.0) + 1.0 / stiffness == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize("stiffness", [0.5, 2.0])
def test_a_dome_feels_a_thick_layer_and_less_of_a_thin_one(stiffness):
    """Contacts have a radius of 1.3 mm; flesh 400 mm below has a part of 0.3 % in the depth."""
    forces = [press(alone(), replace(LEVEL, layer=OuterLayer(h, stiffness)), [0.2])[0, 0] for h in (400.0, 2.0, 0.3)]
    layers, flesh = (press(alone(), replace(LEVEL, E=E), [0.2])[0, 0] for E in (stiffness, 1.0))
    assert forces[0] == pytest.approx(layers, rel=0.005)
    shares = [math.log(force / flesh) / math.log(layers / flesh) for force in forces]
    assert shares[0] > shares[1] > shares[2] > 0.0


def test_flesh_that_yields_carries_at_most_its_pressure():
    """Where a contact yields whole, its force is its area times the pressure; Hertz's mean is 2 / 3 of his peak."""
    dome = alone()
    elastic = Pressing(dome, LEVEL)
    force = elastic.forces(0.2)[0]
    peak = 1.5 * force / elastic.area[0]
    assert press(dome, replace(LEVEL, yields=1.02 * peak), [0.2])[0, 0] == pytest.approx(force, rel=1e-3)
    early = press(dome, replace(LEVEL, yields=0.8 * peak), [0.2])[0, 0]
    soft = Pressing(dome, replace(LEVEL, yields=0.2 * peak))
    late = soft.forces(0.2)[0]
    assert late < early < force
    assert late == pytest.approx(0.2 * peak * soft.area[0], rel=0.05)


def test_a_dome_on_flesh_that_relaxes_answers_as_lee_and_radok_say():
    """On a ramp the depth grows with t, n with t^(3/2); then it is held. One arm of 0.4 and 0.7 s."""
    share, tau = 0.4, 0.7
    times = np.concatenate([np.linspace(0.0, 1.0, 61), [1.5, 3.0]])
    depths = 0.3 * np.minimum(times, 1.0)
    depths[0] = 1e-5
    found = press_over_time(alone(), LEVEL, depths, times, [(share, tau)])[:, 0]
    elastic = press(alone(), LEVEL, [0.3])[0, 0]
    u = np.linspace(0.0, 1.0, 20001)
    for at in (40, 60, 61, 62):
        t, ramp = times[at], min(times[at], 1.0) * u
        n = elastic * min(t, 1.0) ** 1.5
        lag = np.trapezoid(elastic * ramp**1.5 * np.exp((ramp - t) / tau), ramp) / tau
        lag += n * (1.0 - math.exp((min(t, 1.0) - t) / tau))
        assert found[at] == pytest.approx(n - share * lag, rel=2e-3)


def test_a_dome_on_a_spring_sinks_on_in_a_pause():
    """Long after, the flesh has lost its share for good: its force is that of flesh of the modulus that remains."""
    times, travels = [0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 40.0], [0.01, 0.3, 0.6, 0.6, 0.6, 0.6, 0.6]
    found = press_over_time(alone(K=1.0), LEVEL, travels, times, [(0.5, 1.0)])[:, 0]
    assert found[-1] == pytest.approx(press(alone(K=1.0), replace(LEVEL, E=0.5), [0.6])[0, 0], rel=1e-3)
    assert found[2] > found[3] > found[-1]


@pytest.mark.parametrize("exponent", [pytest.param(0.0107, marks=pytest.mark.slow), 0.03])
def test_springs_that_creep_follow_boltzmann(exponent):
    """The deflection is the integral of J(t - s) dF(s) of forces that run straight, J a power that is 1 at 30 s."""
    times = np.array([0.0, 0.3, 0.8, 1.4, 2.0, 3.0, 5.0])
    way = PressMotionOverTime(travels=[0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.9], times=times)
    forces, deflections = press_with_creep(Pressing(square(), LEVEL), way, creep=fit_kelvin_elements(exponent, 30.0))
    slopes = np.diff(forces, axis=0) / np.diff(times)[:, None]
    elastic = press(square(), LEVEL, way.travels)
    assert (np.abs(forces[-1] / elastic[-1] - 1.0) > 0.005).any()
    for at in range(2, len(times)):
        since, until = times[at] - times[:at], times[at] - times[1 : at + 1]
        grown = (since ** (1.0 + exponent) - until ** (1.0 + exponent)) / (1.0 + exponent) / 30.0**exponent
        expected = grown @ slopes[:at] + forces[0] * (times[at] / 30.0) ** exponent
        assert deflections[at] * square().K == pytest.approx(expected, rel=1e-3)


def test_what_lies_beyond_the_rim_is_not_touched():
    """A wall stands beside the first dome, nearer to its axis than where a sphere would touch it."""

    def wall(x, _):
        return 3.0 * np.maximum(-x - 5.1, 0.0)

    beside = replace(LEVEL, bumps=wall)
    domes = replace(square(), rim=2.0)
    assert press(domes, beside, [0.8]) == pytest.approx(press(domes, LEVEL, [0.8]), rel=1e-3)
    assert Pressing(square(), beside).touch[0, 0] < -5.1


@pytest.mark.slow
def test_a_drifting_tilt_is_felt():
    even, drifting = (press(square(), LEVEL, [0.1, 0.4, 0.8], drift=drift)[-1] for drift in ((0.0, 0.0), (0.005, 0.0)))
    side = square().positions[:, 0] > 0.0
    assert (drifting[side] > even[side]).all()
    assert (drifting[~side] < even[~side]).all()


@pytest.mark.slow
def test_a_bruise_lessens_the_force_of_its_dome_and_of_no_other():
    """Others carry more, for the flesh about them sinks less."""
    bruised = replace(LEVEL, softness=(2.0, 1.0, 1.0, 1.0), soft_radius=(6.0, *3 * (math.inf,)))
    ratio = press(square(), bruised, [0.8])[0] / press(square(), LEVEL, [0.8])[0]
    assert ratio[0] < 1.0 < ratio[1:].min()
