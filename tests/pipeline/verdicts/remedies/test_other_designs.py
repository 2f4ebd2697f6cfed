"""What a search says of designs with a process of their own, of lines, and where no key can be tried."""

import dataclasses

import pytest

from cad.design.parameters import Design, GivenSprings, Print, Targets
from cad.design.processes import PROCESSES
from cad.design.tips import Tips
from pipeline.verdicts.remedies.changes import changed
from pipeline.verdicts.remedies.search import nearest_passing
from pipeline.verdicts.remedies.sentences import sentence
from pipeline.verdicts.remedies.trial import Trials

BUDGET = 600
OWN = dataclasses.replace(PROCESSES["fdm-petg"], name="mine")
STIFF = Design(targets=Targets(NL=0.001), print=Print(process="mine"), printer=OWN)
LINE = Design(
    tips=Tips(layout="line", order="LHL", outer_mm=0.01),
    targets=None,
    springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0),
)
PROCESS_ALONE = frozenset({"targets.NL", "targets.P_max", "press.travel_mm", "print.gauges"})


def searched(design, fixed=frozenset(), budget=BUDGET):
    trials = Trials(BUDGET)
    wrong = [verdict.name for verdict in trials(design).wrong]
    trials.left = budget
    return nearest_passing(design, wrong, trials, fixed)


def test_own_process_gives_way_to_a_known_one():
    """As `--set print.process=NAME` does, so that the command that is printed gives the design that was tried."""
    search = searched(STIFF, PROCESS_ALONE)
    assert search.count > 0
    best = search.passing[0]
    assert list(best.changes) == ["print.process"]
    design = changed(STIFF, best.changes)
    assert design.printer is None
    assert design.process is PROCESSES[best.changes["print.process"]]


def test_own_process_stays_where_another_key_changes():
    assert changed(STIFF, {"press.travel_mm": 0.5}).process == OWN


@pytest.mark.parametrize("kept", [PROCESS_ALONE | {"print.process"}, frozenset()])
def test_no_design_tried_is_not_told_as_designs_that_fail(kept):
    """Every key that bears on it is kept, or there is no budget for any."""
    search = searched(STIFF, kept, BUDGET if kept else 0)
    assert (search.count, search.keys) == (0, ())
    assert (
        sentence(STIFF, search)
        == "none found: no key of the design is known to help, or every other value of it is refused"
    )


def test_line_is_mended_by_a_layout_that_has_a_housing():
    """No other key is tried before the layout: none can mend it."""
    search = searched(LINE)
    best = search.passing[0]
    assert best.changes["tips.layout"] in ("pair", "square")
    design = changed(LINE, best.changes)
    assert (design.tips.order, design.tips.outer_mm) == (None, None)
    assert Trials(BUDGET)(design).passes
    assert sentence(LINE, search).startswith("a line has no housing; passes with tips.layout ")


def test_line_whose_layout_is_kept_ends_at_once():
    search = searched(LINE, frozenset({"tips.layout"}))
    assert search.count == 0
    assert sentence(LINE, search).startswith("a line has no housing; none found: ")
