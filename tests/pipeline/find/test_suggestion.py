"""Planted designs that fail are mended by the nearest change, which a run proves, or nothing is suggested."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from stand_ins import GOOD, result_of

from pipeline.find import changes
from pipeline.find import proved_candidate as proof
from pipeline.find import suggestion as room
from pipeline.find.candidate import Candidate
from pipeline.find.changes import change_design, size, sweeps
from pipeline.find.suggestion import Search, suggestion
from pipeline.options import RunOptions, load_design, setting_text
from pipeline.sensor import Sensor
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings, Print, Targets
from sensor.design.processes import PROCESSES
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import InputError

BRUISED = Design(fruit=Fruit(bruise_limit_MPa=1.2))
TIPS = frozenset({"tips.side_mm", "tips.spacing_mm"})
STIFF = Design(targets=Targets(NL=0.001))
OWN = dataclasses.replace(PROCESSES["fdm-petg"], name="mine")
GIVEN = Design(springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0))
MANGO = load_design("mango")


@pytest.fixture(autouse=True)
def few_steps(monkeypatch, request):
    """Try three steps in each direction; the bounds are bisected all the same. Slow tests try all."""
    if request.node.get_closest_marker("slow") is None:
        monkeypatch.setattr(changes, "SMALLER", (0.5, 0.1, 0.02))
        monkeypatch.setattr(changes, "LARGER", (2.0, 10.0, 50.0))


def search_of(design, fixed=frozenset()):
    """Return the search for a design, whose contact is the reference's if its tips are."""
    base = result_of(Design())
    sized = Sensor(design=design, options=RunOptions(tolerance=0.02), springs_as="sized")
    contact = base.contact if design.tips == Design().tips else sized.contact
    pressed = dataclasses.replace(base.pressed, design=design, contact=contact)
    return Search(dataclasses.replace(base, pressed=pressed), fixed)


def searched(design, fixed=frozenset()):
    """Return the search for a design, the names of its verdicts that fail with sized springs, and what passes."""
    search = search_of(design, fixed)
    failed = search_of(design).try_changes({}).failed
    return search, {verdict.name for verdict in failed}, search.find_passing(failed)


@pytest.mark.parametrize(
    ("design", "name", "keys"),
    [
        (dataclasses.replace(STIFF, print=Print(process="mine"), printer=OWN), "printable.high", {"print.process"}),
        (Design(press=PressMotion(travel_mm=3.0)), "printable.low", {"press.travel_mm"}),
    ],
    ids=["NL out of reach of one's own process", "strain"],
)
def test_planted_fault_is_mended(design, name, keys):
    search, names, passing = searched(design)
    assert name in names
    assert set(passing[0].changes) == keys
    assert search.try_changes(passing[0].changes).failed == ()
    sizes = [size(design, one.changes) for one in passing]
    assert sizes == sorted(sizes)


def test_travel_under_a_bruise_limit_is_that_of_its_pressure():
    """Under a flat face the pressure is proportional to the travel; the search stops 5 to 10 % short of the bound."""
    search, _, passing = searched(BRUISED, TIPS)
    (bruise,) = (verdict for verdict in search.try_changes({}).failed if verdict.name == "bruise")
    bound = 0.6 * 1.2 / bruise.value
    assert passing[0].changes == {"press.travel_mm": pytest.approx(0.94 * bound, abs=0.06 * bound)}


def test_travel_that_the_heights_of_printed_tips_decide_is_not_tried():
    """0.073 mm would keep apple flesh whole; PETG tips stand within 0.05 mm, so that 0.25 mm is the least."""
    search = search_of(Design(fruit=Fruit(bruise_limit_MPa=0.29)))
    assert search.try_changes({"press.travel_mm": 0.249}) is None
    assert search.try_changes({"press.travel_mm": 0.25}) is not None


def test_two_keys_are_changed_where_one_does_not_do():
    """A bruise wants less travel, a high spring that is too stiff another NL; leaves, processes and tips are fixed."""
    fixed = TIPS | {"print.process", "targets.P_max"}
    _, names, passing = searched(dataclasses.replace(STIFF, fruit=BRUISED.fruit), fixed)
    assert {"printable.high", "bruise"} <= names
    assert set(passing[0].changes) == {"press.travel_mm", "targets.NL"}


def test_search_without_budget_finds_nothing(monkeypatch):
    failed = search_of(BRUISED).try_changes({}).failed
    monkeypatch.setattr(room, "BUDGET", 0.0)
    search = search_of(BRUISED)
    assert (search.find_passing(failed), search.nearest_miss, search.tried) == ([], None, 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("preset", "settings"),
    [
        ("paper", {"press.tilt_deg": 1.0}),
        pytest.param("paper", {"tips.shape": "sphere", "tips.socket": "pin"}, marks=pytest.mark.study),
        pytest.param("mango", {"readout.noise_um": 4.0}, marks=pytest.mark.study),
    ],
)
def test_scenes_that_are_not_linear_are_mended(preset, settings):
    design = load_design(preset, settings)
    _, names, passing = searched(design)
    assert names
    assert search_of(design).try_changes(passing[0].changes).failed == ()


def test_settings_of_changes_give_the_design_again():
    given = {"springs.K_l_N_per_m": 753.0, "springs.K_h_N_per_m": 17300.0}
    changes = {**dict.fromkeys(given), "press.travel_mm": 0.5, "tips.shape": "sphere", "tips.socket": "pin"}
    settings = {key: setting_text(key, value) for key, value in changes.items()}
    assert load_design("paper", given | settings) == change_design(load_design("paper", given), changes)


def replace_run(monkeypatch, stand_in):
    """Put a stand-in in the place of the design's own run, and of those that prove candidates."""
    monkeypatch.setattr(room, "run", stand_in)
    monkeypatch.setattr(proof, "run", stand_in)


@pytest.fixture
def runs(monkeypatch):
    """Return the designs that were run: contact and springs are the reference's, no solid is looked at."""
    designs = []

    def stand_in(design, _options):
        designs.append(design)
        return result_of(design)

    replace_run(monkeypatch, stand_in)
    return designs


def test_design_that_passes_stays_and_one_that_fails_is_proved_by_a_run(runs):
    assert suggestion(Design(), RunOptions()).changes == {}
    assert len(runs) == 1
    mended = suggestion(BRUISED, RunOptions(), TIPS)
    assert list(mended.changes) == ["press.travel_mm"]
    assert runs[2:] == [mended.changed]
    assert all(verdict.passed for verdict in mended.verdicts)


@pytest.mark.usefixtures("runs")
@pytest.mark.parametrize(("free", "tried"), [("none", 0), ("tips.spacing_mm", 6)])
def test_nothing_is_suggested_where_no_key_that_may_change_helps(free, tried):
    """No other spacing takes a tenth of the pressure away."""
    keys = {"press.travel_mm", "tips.side_mm", "tips.spacing_mm"} - {free}
    stays = suggestion(BRUISED, RunOptions(), frozenset(keys))
    assert (stays.changes, stays.runs) == (None, 1)
    assert stays.tried <= tried
    assert ("tips.spacing_mm" in stays.reason) is (tried > 0)


def test_travel_is_shortened_by_what_the_worst_clearance_lacks(monkeypatch):
    """A clearance grows by as much as the travel shrinks; 2 % are kept. What passes, and a bruise, ask for nothing."""
    clearance = dataclasses.replace(GOOD, name="geometry.frame_clearance", value=0.15, limit=0.2, passed=False)
    tight = (
        clearance,
        dataclasses.replace(clearance, name="geometry.neck_clearance", value=0.1),
        dataclasses.replace(clearance, name="geometry.cover_over_fruit", value=0.0, passed=True),
        dataclasses.replace(clearance, name="bruise", value=2.0),
    )

    def too_tight(design, _options):
        return dataclasses.replace(result_of(design), verdicts=tight if design == Design() else (GOOD,))

    replace_run(monkeypatch, too_tight)
    mended = suggestion(Design(), RunOptions(), TIPS)
    assert (mended.changes, mended.runs) == ({"press.travel_mm": 0.49}, 2)  # 0.98 (0.6 - 0.1)
    stays = suggestion(Design(), RunOptions(), TIPS | {"press.travel_mm"})
    assert (stays.changes, stays.runs) == (None, 1)


NUMBERS = {"press.travel_mm", "springs.K_l_N_per_m", "springs.K_h_N_per_m", "tips.side_mm", "tips.spacing_mm"}


@pytest.mark.parametrize(
    ("design", "failed", "keys"),
    [
        (STIFF, {"printable.high"}, {"targets.NL", "targets.P_max", "print.process", "press.travel_mm"}),
        (GIVEN, {"K_l"}, {"springs.K_l_N_per_m", "springs.K_h_N_per_m", "print.process", "press.travel_mm"}),
        (MANGO, {"reading.bias", "reading.uncertainty"}, {"reading.tilt_deg", "reading.bias_limit",
         "reading.uncertainty_limit", "reading.calibrated_by", "tips.dome_radius_mm", *NUMBERS}),
        # back to what the two-spring law holds for: a level press, sharp flat faces, springs that the targets size
        (Design(tips=Tips(fillet_mm=0.1, socket="pin"), press=PressMotion(tilt_deg=1.0, roll_deg=0.5, attitude="down")),
         {"P_monotonic"}, {"press.tilt_deg", "press.roll_deg", "press.attitude", "press.travel_mm", "tips.fillet_mm",
         "tips.side_mm", "tips.spacing_mm"}),
        (Design(tips=Tips(shape="sphere", socket="pin")), {"P_monotonic"}, {"press.travel_mm", "tips.shape",
         "tips.side_mm", "tips.spacing_mm"}),
        (GIVEN, {"P_monotonic"}, NUMBERS),
        # readings of flat tips are too slow to try, so that no demand of theirs is lowered
        (Design(reading=ReadingRequirements()), {"reading.bias", "reading.uncertainty"}, {"tips.side_mm",
         "tips.spacing_mm", "press.travel_mm", "reading.calibrated_by"}),
    ],
)  # fmt: skip
def test_keys_that_may_mend_a_verdict(design, failed, keys):
    assert {
        key for sweep in sweeps(design, failed, is_solved_on_cells=False) for change in sweep for key in change
    } == keys


@pytest.mark.parametrize(
    ("design", "failed", "key", "before", "factors"),
    [
        (STIFF, "printable.high", "targets.NL", 0.001, (0.5, 0.1, 0.02, 2.0, 10.0, 50.0)),
        (STIFF, "printable.high", "press.travel_mm", 0.6, (0.5, 0.1, 0.02, 2.0, 10.0, 50.0)),
        (MANGO, "reading.uncertainty", "reading.uncertainty_limit", (0.05, 0.06, 0.08, 0.1), (2.0, 10.0, 50.0)),
    ],
    ids=["target", "travel", "list"],
)
def test_sweeps_of_numbers_multiply_the_value_of_the_design(design, failed, key, before, factors):
    chosen = [
        change for sweep in sweeps(design, {failed}, is_solved_on_cells=False) for change in sweep if key in change
    ]
    for change, factor in zip(chosen, factors, strict=True):
        assert np.asarray(change[key]) == pytest.approx(factor * np.asarray(before), rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"press.travel_mm": 0.3}, (1, 0, math.log(2.0))),
        ({"springs.K_h_N_per_m": 34600.0, "press.travel_mm": 0.6}, (2, 0, math.log(2.0))),
        ({"springs.K_l_N_per_m": None, "print.process": "sla-resin"}, (2, 0, 2.0)),  # no ratio: each counts as 1
        ({"press.tilt_deg": 1.0}, (1, 0, 1.0)),  # from 0
        ({"reading.tilt_deg": None}, (1, 1, 1.0)),  # a demand
    ],
)
def test_size_of_changes(changes, expected):
    assert size(GIVEN, changes) == pytest.approx(expected)


def test_candidate_that_its_run_refutes_is_not_suggested(monkeypatch):
    """Each changed design fails a check of its solid, or is refused."""

    def refuted(design, _options):
        if design.press.travel_mm <= 0.05:
            raise InputError("refused")
        found = result_of(design)
        if design == BRUISED:
            return found
        return dataclasses.replace(found, verdicts=(dataclasses.replace(GOOD, passed=False),))

    replace_run(monkeypatch, refuted)
    refused = suggestion(BRUISED, RunOptions(), TIPS)
    assert refused.changes is None
    assert 1 < refused.runs <= 1 + room.MAX_RUNS


def test_no_more_candidates_are_run_than_allowed(monkeypatch):
    monkeypatch.setattr(proof, "run", lambda *_: SimpleNamespace(passed=False))
    candidates = [Candidate(changes={"press.travel_mm": travel}, verdicts=()) for travel in (0.1, 0.2, 0.3)]
    for allowed in (1, 2, 3, 4):
        last = proof.prove_first(candidates, lambda _: Design(), RunOptions(), allowed)
        assert (last.runs, last.candidate) == (min(allowed, 3), candidates[min(allowed, 3) - 1])


def test_undecided_design_is_given_a_tolerance_and_nothing_is_tried(monkeypatch):
    wide = dataclasses.replace(GOOD, name="K_l", limit=900.0, tolerance=0.001, relative=True, error=9.0, passed=None)
    replace_run(monkeypatch, lambda design, _: dataclasses.replace(result_of(design), verdicts=(wide,)))
    undecided = suggestion(Design(), RunOptions(tolerance=0.02))
    assert (undecided.changes, undecided.tried) == (None, 0)
    assert "--tol 0.001" in undecided.reason
