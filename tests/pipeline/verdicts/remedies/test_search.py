"""Planted designs that fail are mended by what the search finds; where nothing mends them it says what it tried."""

import functools

import pytest

from pipeline.options import load_design
from pipeline.verdicts.remedies.changes import changed, flags, size
from pipeline.verdicts.remedies.search import nearest_passing
from pipeline.verdicts.remedies.trial import Trials

BUDGET = 2000


@functools.cache
def found(preset, budget=BUDGET, fixed=frozenset(), **settings):
    """Return a design, the names of its verdicts that do not pass, and the search for what mends it."""
    design = load_design(preset, {key.replace("__", "."): value for key, value in settings.items()})
    trials = Trials(budget)
    wrong = [verdict.name for verdict in trials(design).wrong]
    return design, wrong, nearest_passing(design, wrong, trials, fixed)


@pytest.mark.parametrize(
    ("settings", "wrong", "key"),
    [
        ({"fruit__bruise_limit_MPa": "0.29"}, {"bruise"}, "press.travel_mm"),
        ({"targets__NL": "0.001"}, {"printable.high"}, "print.process"),
        (
            {"print__process": "dmls-17-4ph", "print__max_length_mm": "35"},
            {"printable.low", "printable.high"},
            "print.process",
        ),
        ({"press__travel_mm": "3"}, {"printable.low", "printable.high"}, "press.travel_mm"),
        ({"springs__K_l_N_per_m": "753", "springs__K_h_N_per_m": "17300"}, {"P_max", "NL"}, "tips.side_mm"),
    ],
    ids=["bruise", "NL out of reach", "process", "strain", "given springs"],
)
def test_planted_fault_is_mended_by_one_key(settings, wrong, key):
    design, names, search = found("paper", **settings)
    assert wrong <= set(names)
    best = search.passing[0]
    assert list(best.changes) == [key]
    assert Trials(BUDGET)(changed(design, best.changes)).passes


def test_travel_under_a_bruise_limit_is_that_of_its_pressure():
    """Forces grow in step with the travel, so the pressure does: 3.746 MPa x (travel / 0.6 mm) is the limit at most."""
    design, _, search = found("paper", fruit__bruise_limit_MPa="0.29")
    (verdict,) = (v for v in Trials(BUDGET)(design).verdicts if v.name == "bruise")
    bound = 0.6 * 0.29 / verdict.value
    travel = search.passing[0].changes["press.travel_mm"]
    assert 0.9 * bound < travel < bound


def test_key_that_is_kept_is_not_changed():
    _, _, search = found("paper", fixed=frozenset({"press.travel_mm"}), fruit__bruise_limit_MPa="0.29")
    assert "press.travel_mm" not in search.keys
    assert all("press.travel_mm" not in one.changes for one in search.passing)


def test_what_passes_is_ordered_by_keys_then_by_size():
    design, _, search = found("paper", targets__NL="0.001")
    sizes = [size(design, one.changes) for one in search.passing]
    assert sizes == sorted(sizes)
    assert len(sizes) > 1


def test_two_keys_are_changed_where_one_does_not_do():
    """A bruise wants less travel, a high spring that is too stiff another NL."""
    kept = frozenset({"print.process", "tips.side_mm", "tips.spacing_mm"})
    design, names, search = found("paper", fixed=kept, targets__NL="0.001", fruit__bruise_limit_MPa="0.29")
    assert {"printable.high", "bruise"} <= set(names)
    assert set(search.passing[0].changes) == {"press.travel_mm", "targets.NL"}
    assert Trials(BUDGET)(changed(design, search.passing[0].changes)).passes


@pytest.mark.slow
def test_reading_that_is_too_uncertain_is_mended():
    design, names, search = found("mango", reading__noise_percent="1.0")
    assert "reading.uncertainty" in names
    assert Trials(BUDGET)(changed(design, search.passing[0].changes)).passes


@pytest.mark.slow
@pytest.mark.parametrize("settings", [{"press__tilt_deg": "1.0"}, {"tips__shape": "sphere"}])
def test_press_that_is_not_level_is_mended(settings):
    design, names, search = found("paper", budget=6000, **settings)
    assert "P_displacement_independent" in names
    assert Trials(6000)(changed(design, search.passing[0].changes)).passes


def test_fault_that_nothing_mends_is_said_to_be_one():
    """All keys that could help stay as they are."""
    kept = frozenset({"press.travel_mm", "tips.side_mm", "tips.spacing_mm"})
    _, _, search = found("paper", fixed=kept, fruit__bruise_limit_MPa="0.29")
    assert (search.passing, search.least) == ((), None)


def test_search_ends_with_its_budget():
    design = load_design("paper", {"fruit.bruise_limit_MPa": "0.29"})
    trials = Trials(0)
    assert nearest_passing(design, ["bruise"], trials).passing == ()
    assert trials.count == 0


def test_flags_give_the_design_again():
    design = load_design("paper", {"springs.K_l_N_per_m": "753", "springs.K_h_N_per_m": "17300"})
    changes = {"springs.K_l_N_per_m": None, "springs.K_h_N_per_m": None, "press.travel_mm": 0.5, "tips.shape": "sphere"}
    words = flags(changes)
    assert words[:2] == ["--set", "springs.K_l_N_per_m="]
    settings = dict(word.split("=", 1) for word in words if word != "--set")
    assert load_design("paper", settings) == changed(design, changes)
