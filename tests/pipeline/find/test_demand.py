"""Where no sensor is found for a fruit, the ranges that failing verdicts depend on become narrower, step by step."""

import math

import pytest

from pipeline.find import demand
from pipeline.find.demand import MAX_ROUNDS, NARROWED_FRACTION, narrow_ranges, nearest_demand
from pipeline.find.fruit_range import fruit_range
from pipeline.find.suggestion import Suggestion
from pipeline.options import load_design
from sensor.quantity import Estimate
from sensor.verdict import judge

FRUIT = fruit_range("radius 23 to 57 by 33 to 80, flesh 14 to 30, E 0.4 to 3.5")
MANGO = load_design("mango")
BIAS = judge("reading.bias", Estimate(0.08, 0.001), "", limit=0.05)
SOFT, FIRM = (judge("reading.uncertainty", Estimate(0.12, 0.001), "", limit=limit) for limit in (0.05, 0.10))
STEP = math.log(3.5 / 0.4) * NARROWED_FRACTION


def logs(fruit):
    return [
        [math.log(end) for end in ends]
        for ends in (*fruit.radii_mm, fruit.thickness_mm, (fruit.E_min_MPa, fruit.E_max_MPa))
    ]


ONE_LIMIT = load_design("mango", {"reading.uncertainty_limit": "0.1"})


@pytest.mark.parametrize(
    ("failed", "of_shape", "at_softest", "at_firmest", "preset"),
    [
        ((BIAS,), 1, 0, 0, MANGO),
        ((SOFT,), 0, 1, 0, MANGO),
        ((FIRM,), 0, 0, 1, MANGO),
        ((FIRM,), 0, 1, 1, ONE_LIMIT),
        ((judge("printable.low", None, "", limit="4 to 120"),), 0, 1, 0, MANGO),
        ((judge("reading.calibration", 0.2, ""),), 0, 1, 0, MANGO),
        ((BIAS, FIRM), 1, 0, 1, MANGO),
        ((), 1, 0, 0, MANGO),
    ],
)
def test_a_round_takes_a_step_from_the_ends_at_which_verdicts_fail(failed, of_shape, at_softest, at_firmest, preset):
    *before, moduli = logs(FRUIT)
    *after, eased_moduli = logs(narrow_ranges(FRUIT, FRUIT, failed, preset))
    for (least, most), ends in zip(before, after, strict=True):
        step = of_shape * NARROWED_FRACTION * (most - least)
        assert ends == pytest.approx([least + step, most - step], abs=5e-3)  # rounded to three digits
    assert eased_moduli == pytest.approx([moduli[0] + at_softest * STEP, moduli[1] - at_firmest * STEP], abs=5e-3)


def test_ranges_never_turn_round():
    fruit = FRUIT
    for _ in range(10):
        fruit = narrow_ranges(fruit, FRUIT, (BIAS,), MANGO)
    for least, most in logs(fruit)[:3]:
        assert least <= most
        assert most - least < 5e-3


@pytest.mark.parametrize("passes_in_round", [1, 3, MAX_ROUNDS, MAX_ROUNDS + 1])
def test_the_first_fruit_for_which_a_design_passes_is_returned(passes_in_round, monkeypatch):
    tried = []

    def found(fruit, preset, fixed, _progress):
        assert (preset, fixed) == (MANGO, {"tips.side_mm"})
        tried.append(fruit)
        passes = len(tried) == passes_in_round
        return Suggestion(design=preset, changes={} if passes else None, verdicts=(FIRM,))

    monkeypatch.setattr(demand, "fruit_suggestion", found)
    fruit = nearest_demand(FRUIT, [FIRM], MANGO, frozenset({"tips.side_mm"}))
    assert fruit == (tried[-1] if passes_in_round <= MAX_ROUNDS else None)
    assert [round(math.log(3.5 / one.E_max_MPa) / STEP) for one in tried] == list(range(1, len(tried) + 1))
    assert len(tried) == min(passes_in_round, MAX_ROUNDS)
    assert fruit_range(tried[0].in_words) == tried[0]
