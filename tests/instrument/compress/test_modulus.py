"""Virtual compression tests of fruit of known modulus: what is found, its error bar, and what a batch of them says."""

import functools
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from refusal import refusal
from stand_ins import specimen
from virtual_compression import VirtualTest, over_hertz, true_force

from instrument.compress.force_law import TestGeometry, solve_force_law
from instrument.compress.modulus import measure_modulus
from instrument.compress.pressed_shapes import Ellipsoid
from instrument.compress.range_choice import _weighted_mean
from instrument.compress.summary import find_design_range, fruit_summaries, overall_modulus
from sensor.quantity import Estimate


def ball(radius=35.0, height=70.0):
    return Ellipsoid(height_mm=height, radius_mm=radius, radius_across_mm=radius)


BALL = TestGeometry(body=ball())
QUIET = VirtualTest(E_MPa=1.0, noise_percent=0.05, toe_mm=0.0, offset_N=0.0, failure_strain=0.11)
X, F = QUIET.curve()


@functools.cache
def measure(test, geometry=BALL):
    return measure_modulus(specimen(*test.curve()), geometry)


def error_of(result, E):
    """Return the relative error of a modulus [1], and whether it lies inside the error bar."""
    error = result.E_MPa / E - 1.0
    return error, abs(error) <= 0.01 * result.u_percent


def runs(count, seed, **fixed):
    """Test random fruit, E 0.5 to 3.5: return their relative errors [1] and how many lie inside the error bar."""
    random = np.random.default_rng(seed)
    errors = []
    for index in range(count):
        drawn = {
            "E_MPa": random.uniform(0.5, 3.5),
            "offset_N": random.uniform(-2.0, 2.0),
            "toe_mm": random.uniform(0.05, 0.3),
            "toe_share": random.uniform(0.01, 0.06),
            "gap_mm": random.uniform(0.4, 1.5),
            "failure_strain": random.uniform(0.05, 0.1),
        }
        test = VirtualTest(**{**drawn, **fixed}, seed=1000 * seed + index)
        errors.append(error_of(measure(test), test.E_MPa))
    relative, inside = np.transpose(errors)
    return relative, int(inside.sum())


def least_inside(count):
    """Return how many of some runs lie in error bars of 95 % with a chance of 99.9 %: the binomial less 3.1 sigma."""
    return math.floor(0.95 * count - 3.1 * math.sqrt(0.95 * 0.05 * count))


@pytest.mark.parametrize(
    ("count", "seed", "largest", "fixed"),
    [
        (3, 1, 0.03, {}),
        (2, 4, 0.03, {"drift_N_per_mm": 0.5, "noise_percent": 0.2}),
        (2, 6, 0.05, {"rows": 20, "noise_percent": 0.3}),
        *(
            pytest.param(40, 3, 0.06, fixed, marks=pytest.mark.study)
            for fixed in ({}, {"rows": 200}, {"rows": 4000}, {"gap_mm": 0.0}, {"noise_percent": 0.1})
        ),
    ],
)
def test_modulus_is_found_and_its_error_bar_holds_it(count, seed, largest, fixed):
    """A drift of 0.5 N/mm on about 50 N at the end would be 5 % and more."""
    errors, inside = runs(count, seed, **fixed)
    assert np.abs(errors).max() < largest
    assert inside >= least_inside(count)


@pytest.mark.parametrize(
    "settling",
    [
        "soft layer",
        *(
            pytest.param(name, marks=pytest.mark.study)
            for name in ("exponential in travel", "linear foot", "noise of the force")
        ),
    ],
)
def test_what_the_fit_does_not_know_is_inside_the_error_bar(settling):
    """Laws of settling that the fit does not have, and noise in proportion to the force."""
    E = 1.5
    inside = 0
    depth = np.linspace(-0.8, 5.0, 700)
    D = np.maximum(depth, 0.0)
    force = {
        "exponential in travel": true_force(E, D) * (1.0 - np.exp(-D / 0.15)),
        "soft layer": true_force(E, np.maximum(depth - 0.2, 0.0)) + 0.5 * np.clip(depth, 0.0, 0.4),
        "linear foot": np.where(D < 0.3, 2.0 * true_force(E, np.array([0.3]))[0] * D, true_force(E, D)),
        "noise of the force": true_force(E, D),
    }[settling]
    scale = force if settling == "noise of the force" else force.max()
    for seed in range(2):
        noise = 0.01 * scale * np.random.default_rng(seed).normal(size=len(force))
        error, held = error_of(measure_modulus(specimen(depth + 0.8, force + noise), BALL), E)
        assert abs(error) < 0.03
        inside += held
    assert inside >= least_inside(2)


def yields_and_bears_more(travel, force):
    """Return the curve of an apple that yields and bears more again: the larger force is not its first failure."""
    further = np.linspace(0.0, 8.0, 700)[1:]
    return np.r_[travel, travel[-1] + further], np.r_[force, force[-1] + 12.0 * further]


def loses_rows(travel, force):
    """Return a curve of a machine that has sent no data for a while."""
    return np.delete(travel, slice(250, 330)), np.delete(force, slice(250, 330))


@pytest.mark.parametrize("change", [yields_and_bears_more, loses_rows])
def test_what_fruit_and_machine_do_besides_does_not_move_the_modulus(change):
    test = VirtualTest(E_MPa=2.0, offset_N=0.0, noise_percent=0.3)
    result = measure_modulus(specimen(*change(*test.curve())), BALL)
    assert result.E_MPa == pytest.approx(2.0, rel=0.03)
    assert result.failure_mm == pytest.approx(test.first_touch_mm + 0.07 * 70.0, abs=0.15)
    assert result.range_end_mm <= result.failure_mm


def test_curve_of_a_block_is_said_not_to_follow_hertz():
    """A cut cylinder has F = E A D / h: no Hertz modulus."""
    depth = np.linspace(-1.0, 4.0, 600)
    noise = np.random.default_rng(1).normal(0.0, 0.05, 600)
    result = measure_modulus(specimen(depth + 1.0, 2.0 * 300.0 * np.maximum(depth, 0.0) / 70.0 + noise), BALL)
    assert not result.follows_law
    assert measure(QUIET).follows_law


@pytest.mark.parametrize(("height", "notes"), [(70.0, 0), (14.0, 1)])
def test_travel_of_a_third_of_the_height_is_noted(height, notes):
    """As where a height in cm was given in mm. A ball has a tenth of its force at 0.1^(2/3) of its travel."""
    result = measure(QUIET, TestGeometry(body=ball(0.5 * height, height)))
    percent = [re.search(rf"([0-9.]+) % of the height, {height:g} mm", note) for note in result.notes]
    expected = 100.0 * 0.11 * 70.0 / height * (1.0 - 0.1 ** (2.0 / 3.0))
    assert [float(found[1]) for found in percent if found] == pytest.approx(notes * [expected], rel=0.1)


def test_paper_modulus_of_a_ball_is_that_of_the_formula():
    """Secant c E* sqrt(D) H / A with c of two plates, and what a ball bears more than Hertz's law has it."""
    result = measure(QUIET)
    secants = {secant.strain_percent: secant for secant in result.secants}
    for strain in (2.0, 5.0, 10.0):
        near = 0.01 * strain * np.array([0.999, 1.0, 1.001])
        hertz = 4.0 / 3.0 * np.sqrt(35.0 / 8.0) / 0.91 * np.sqrt(70.0 * near) * 70.0 / 900.0
        exact = hertz * over_hertz(near)
        assert secants[strain].E_secant_MPa == pytest.approx(exact[1], rel=0.01)
        tangent = (exact[2] * near[2] - exact[0] * near[0]) / (near[2] - near[0])
        assert secants[strain].E_tangent_MPa == pytest.approx(tangent, rel=0.02)
    assert result.E_plate_MPa == secants[5.0].E_secant_MPa
    assert result.reads_low == pytest.approx(result.E_MPa / result.E_plate_MPa)


def test_secant_and_tangent_are_as_uncertain_as_said():
    """Their scatter in 6 noisy tests of E 1 is that of their error bars: with 6 draws within a factor of 2."""
    secants = [measure(VirtualTest(E_MPa=1.0, seed=seed)).secants[0] for seed in range(6)]
    for name in ("secant", "tangent"):
        values = np.array([getattr(secant, f"E_{name}_MPa") for secant in secants])
        stated = np.mean([getattr(secant, f"u_{name}_percent") for secant in secants])
        assert 0.5 * stated < 196.0 * values.std() / values.mean() < 2.0 * stated


def test_strain_beyond_the_curve_is_taken_at_its_end():
    result = measure(QUIET, replace(BALL, strains_percent=(40.0, 5.0, 30.0)))
    first, second = (secant.strain_percent for secant in result.secants)
    reach = 100.0 * (result.curve.travel[-1] - result.first_touch_mm) / 70.0
    assert first == pytest.approx(0.95 * reach, rel=0.05)  # two digits
    assert first <= 0.95 * reach
    assert second == 5.0


@pytest.mark.parametrize(
    ("travel", "force", "place"),
    [
        (X, 1e-3 * F, ": modulus"),
        (X, 1e3 * F, ": modulus"),
        (1e-3 * X, F, ": modulus"),
        (1e3 * X, F, ": travel under load"),
    ],
    ids=["force in mN", "force in kN", "travel in um", "travel in m"],
)
def test_number_in_another_unit_is_refused(travel, force, place):
    assert refusal(measure_modulus, specimen(travel, force), BALL).field == f"virtual.csv, specimen '1'{place}"


def test_what_is_unusual_is_noted():
    """Newtons called kilogram-force are 9.8 times too many; no idle travel; a drift."""
    usual = measure(QUIET).notes
    travel, force = VirtualTest(E_MPa=2.0).curve()
    unusual = measure_modulus(specimen(travel, 9.80665 * force), BALL).notes
    drifting = measure(VirtualTest(E_MPa=1.0, drift_N_per_mm=0.5, noise_percent=0.2)).notes
    touching = measure_modulus(specimen(X[60:], F[60:]), BALL).notes
    assert [len(notes) - len(usual) for notes in (unusual, drifting, touching)] == [1, 1, 1]


def test_batch_has_mean_deviation_and_the_range_for_the_design():
    result = measure(QUIET)
    results = []
    for file, E in (("a/1", 0.8), ("a/2", 1.0), ("b/1", 3.0), ("b/2", 3.2)):
        results.append(replace(result, E_MPa=E, u_percent=2.0, file=file))
    assert result.E_over_1_minus_nu2_MPa == pytest.approx(result.E_MPa / 0.91)
    assert len(fruit_summaries(results, by_folder=False)) == 4
    first, second = fruit_summaries(results, by_folder=True)
    assert (first.count, second.count) == (2, 2)
    assert (first.E_MPa, second.E_MPa) == pytest.approx((0.9, 3.1))
    assert first.E_deviation_MPa == pytest.approx(0.2 / np.sqrt(2.0))
    assert overall_modulus([first, second]).E_MPa == pytest.approx(2.0)
    # 0.8 less 2 % is 0.784, 3.2 and 2 % is 3.264; equal steps between, in three digits
    span = find_design_range(results)
    assert span.E_max_MPa == 3.3
    assert span.E_MPa == (0.78, 1.2, 1.62, 2.04, 2.46, 2.88, 3.3)
    single = find_design_range(results[:1])
    assert (single.E_max_MPa, single.E_MPa) == (0.82, (0.8,))
    wide = find_design_range([replace(results[0], u_percent=99.0), results[1]])
    assert (wide.E_max_MPa, wide.E_MPa[0]) == (1.6, 0.008)


@pytest.mark.parametrize("row", [40, 80])
def test_bar_that_reaches_to_zero_is_refused_and_the_odd_row_is_named(row):
    """One force of twice its size among 120 looks like the load at which the flesh fails."""
    force = F[::5].copy()
    force[row] *= 2.0
    spoilt = specimen(X[::5], force)
    told = refusal(measure_modulus, spoilt, BALL)
    assert told.field == f"{spoilt}: error of the modulus"
    assert told.value > 100.0
    assert spoilt.cell(row, "force") in str(told)


def test_hertz_reads_a_ball_high_and_the_solved_force_does_not():
    """Two half-spaces do not feel each other: to 4 and to 11 % of the height a ball bears 1.1 and 1.2 times Hertz's.

    The plates here are slippery; the law of the product is midway to a grip, of 2 % at the end.
    """
    for failure_strain, apparent in ((0.04, 1.12), (0.11, 1.21)):
        result = measure(replace(QUIET, failure_strain=failure_strain))
        assert result.E_MPa == pytest.approx(1.0, rel=0.015)
        assert result.E_hertz_MPa == pytest.approx(apparent, rel=0.05)
        assert not result.follows_hertz


def test_error_is_made_of_its_shares():
    result = measure(QUIET)
    shares = dict(result.shares_percent)
    bounds = shares.pop("law of flesh") + shares.pop("friction")
    assert result.u_percent == pytest.approx(math.hypot(*shares.values()) + bounds)
    names = {"scatter of the points", "force curve", "law of flesh", "Poisson's ratio", "friction"}
    assert set(result.shares_percent) == names
    assert min(result.shares_percent.values()) > 0.0


def test_law_and_friction_that_are_not_known_are_in_the_error_bar():
    """The curve that a press by another law, or with a grip, would give: read with the law of the product."""
    counts = []
    law = solve_force_law(BALL, lambda *count: counts.append(count))
    assert counts == sorted(counts)
    assert counts[0] == (0, counts[-1][0] + 1)  # each part but the last, while it is solved, is told
    for variants in law.variants.values():
        for variant in variants[-1:]:
            travel = np.concatenate([np.linspace(0.0, 0.9, 60), 1.0 + variant.travels])
            force = np.concatenate([np.zeros(60), 2.0 * variant.forces])
            result = measure_modulus(specimen(travel, force), BALL)
            assert abs(result.E_MPa - 2.0) < 0.01 * result.u_percent * result.E_MPa
            assert abs(result.E_MPa - 2.0) > 0.005


@pytest.mark.parametrize(
    ("argument", "value", "field"),
    [
        *(("plates", value, "modulus.plates") for value in (3, 0, -1, 1.5, True, "2", None)),
        *(("body", value, "body") for value in (None, "ball", 70.0)),
        *(("plunger", value, "plunger") for value in (4, "flat")),
        *(("strains_percent", value, "modulus.strains_percent") for value in (5.0, [], [5.0, "2"], "5")),
    ],
)
def test_body_or_tool_of_another_kind_is_refused(argument, value, field):
    assert refusal(replace, BALL, **{argument: value}).field == field


def test_strains_and_plates_are_lists_and_numbers_of_any_kind():
    for strains in ([5.0, 2.0], np.array([5.0, 2.0])):
        assert replace(BALL, strains_percent=strains) == replace(BALL, strains_percent=(5.0, 2.0))
    assert replace(BALL, plates=np.int64(1)) == replace(BALL, plates=1)


@pytest.mark.parametrize("poisson", [-0.1, 0.495])
def test_ratio_that_is_not_solved_is_refused(poisson):
    told = refusal(replace, BALL, poisson=poisson)
    assert (told.field, told.value) == ("modulus.poisson", poisson)


def test_two_estimates_are_joined_as_a_mixture_of_their_distributions(rng):
    """Its variance is E[x^2] - E[x]^2, also found by drawing from it."""
    first, second, probability = Estimate(1.0, 0.2), Estimate(3.0, 0.5), 0.3
    joined = _weighted_mean(probability, first, second)
    mean_square = 0.3 * (1.0 + 0.04) + 0.7 * (9.0 + 0.25)
    assert (joined.value, joined.error**2) == pytest.approx((2.4, mean_square - 2.4**2), rel=1e-12)
    which = rng.random(100_000) < probability
    drawn = np.where(which, rng.normal(1.0, 0.2, which.size), rng.normal(3.0, 0.5, which.size))
    assert (joined.value, joined.error) == pytest.approx((drawn.mean(), drawn.std()), rel=0.02)
