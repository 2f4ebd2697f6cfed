"""The proof of a design: what counts as outside, and a law that is planted wrong is found."""

from dataclasses import replace

import pytest
from refusal import refusal

from instrument.press.measuring import MeasuringUnit
from instrument.proof import ProvedReading, evaluate_proof, prove
from sensor.quantity import InputError


def reading(bars=0.5, *flags, E_read=1.0):
    u, E = 0.2, 1.0 + 0.2 * bars
    error = None if E_read is None else E_read / E - 1.0
    return ProvedReading(
        E=E, radii=(45.0, 90.0), thickness=12.0, tilt=1.0, E_read=E_read, u=u, error=error, flags=flags
    )


GOOD = [reading(0.9), reading(-0.9), reading(0.1, "out_of_range"), reading(0.2, "press_over_bruise_limit")]


@pytest.mark.parametrize(
    ("readings", "outside", "flagged", "passed"),
    [
        (15 * GOOD, 0, 0, True),
        (13 * GOOD + 7 * [reading(1.1)] + [reading()], 7, 0, True),
        (13 * GOOD + 8 * [reading(1.1)], 8, 0, False),
        (59 * [reading()] + [reading(-2.1)], 1, 0, False),
        (59 * [reading()] + [reading(2.1, "out_of_range")], 1, 0, False),
        (54 * [reading()] + 6 * [reading(9.0, "uncertain")], 0, 6, True),
        (53 * [reading()] + 7 * [reading(0.1, "one_sample")], 0, 7, False),
        (53 * [reading()] + 7 * [reading(E_read=None)], 0, 7, False),
    ],
)
def test_what_an_honest_design_may_have(readings, outside, flagged, passed):
    """Of 60 readings outside by 5 % each, more than 7 are in a hundredth of all cases."""
    proof = evaluate_proof("mango", 1, readings)
    assert (proof.outside, proof.flagged, proof.passed) == (outside, flagged, passed)
    assert bool(proof.failures) is not passed


@pytest.mark.parametrize(("count", "most"), [(1, 1), (20, 4), (60, 7), (1000, 67)])
def test_the_point_of_the_binomial_follows_the_count(count, most):
    assert evaluate_proof("mango", 1, count * [reading()]).most_outside == most


@pytest.mark.slow
def test_a_press_is_held_to_the_truth(mango):
    """The same press of the same seed, whatever comes after it."""
    heard = []
    proof = prove(mango.report, 1, 4, heard.append)
    (found,) = proof.readings
    assert heard == [1]
    assert found.E_read == pytest.approx(found.E, rel=2.0 * found.u)
    assert found.error == pytest.approx(found.E_read / found.E - 1.0)


@pytest.mark.parametrize(("refused", "again"), [(0, 0), (2, 2), (5, None)])
def test_a_press_without_a_solution_is_drawn_again(refused, again, mango, monkeypatch):
    draws = []

    def proved(_, rng):
        draws.append(rng.random())
        if len(draws) <= refused:
            msg = "no solution"
            raise InputError(msg)
        return reading()

    monkeypatch.setattr("instrument.proof._simulate_reading", proved)
    if again is None:
        refusal(prove, mango.report, 3, 1)
        return
    assert prove(mango.report, 3, 1).drawn_again == again
    assert len(set(draws)) == len(draws) == 3 + again


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.6, pytest.param(1.7, marks=pytest.mark.study)])
def test_a_law_that_is_wrong_by_a_factor_is_found(factor, mango, monkeypatch):
    """A ball would take a factor of all readings out; so the unit is one that a plate calibrated."""
    corrected = MeasuringUnit.correct_modulus
    monkeypatch.setattr(MeasuringUnit, "correct_modulus", lambda *given: factor * corrected(*given))
    monkeypatch.setattr("instrument.proof.fit_ball_correction", lambda *_: pytest.fail("no ball"))
    report = without_ball(mango.report)
    assert not prove(report, 4, 1).passed


def without_ball(report):
    reading_of = replace(report.design.reading, calibrated_by="plate")
    return replace(report, design=replace(report.design, reading=reading_of))
