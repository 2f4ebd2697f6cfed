"""The answer to a run fits one screen and says what is wrong and where to look; on request every verdict is there."""

import dataclasses
from pathlib import Path

import pytest
from stand_ins import GOOD, print_everything, print_summary, result_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design, GivenSprings
from pipeline.options import RunOptions
from pipeline.report.answer.answer import WIDTH
from pipeline.report.verdict_table import print_verdicts

MOST_LINES = 24  # of a terminal as it opens
PAPER_SPRINGS = Design(springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0))
IN_FOLDER = RunOptions(out=Path("outputs/paper"))


def printed(show, result, capsys):
    capsys.readouterr()
    show(result)
    return capsys.readouterr().out


def with_verdicts(result, *verdicts):
    return dataclasses.replace(result, verdicts=(*result.verdicts, *verdicts))


def wrong(name, passed, reason="why"):
    return dataclasses.replace(GOOD, name=name, passed=passed, reference=reason)


def fits_one_screen(text):
    lines = text.splitlines()
    return len(lines) <= MOST_LINES and max(map(len, lines)) <= WIDTH


def test_answer_to_the_default_run_fits_one_screen(default_run):
    assert fits_one_screen(default_run.printed)
    assert default_run.printed.startswith("passed  twintip · paper: all ")


def test_answer_to_the_default_run_breaks_no_sentence(default_run):
    """A line that goes on in the next one is longer than a screen is wide."""
    starts = ("passed", "low spring:", "high spring:", "files in", "look at it:", "all verdicts")
    sentences = [line for line in default_run.printed.splitlines() if not line.startswith(("┏", "┃", "┡", "│", "└"))]
    broken = [line for line in sentences if not line.startswith(starts)]
    assert [line for line in broken if str(default_run.folder) not in line] == []


@pytest.mark.parametrize(
    "result",
    [
        result_of(options=IN_FOLDER),
        result_of(PAPER_SPRINGS, IN_FOLDER),
        result_of(options=IN_FOLDER, made=False),
        with_verdicts(result_of(options=IN_FOLDER), *(wrong(f"geometry.wall_{n}", False) for n in range(40))),
    ],
    ids=["passed", "paper's springs", "not made", "forty failed"],
)
def test_answer_fits_one_screen_whatever_is_wrong(result, capsys):
    assert fits_one_screen(printed(print_summary, result, capsys))


def test_answer_names_targets_values_and_both_springs(capsys):
    text = printed(print_summary, result_of(), capsys)
    for name in ("P_max", "NL", "K_l", "K_h", "P_displacement_independent", "P_monotonic"):
        assert f"│ {name} " in text
    assert "low spring: 905.7" in text
    assert "leaves 14.76 x 1.2 x 10 mm in fdm-petg" in text
    assert "3 on geometry and print" in text


def test_answer_says_where_to_look(capsys):
    text = printed(print_summary, result_of(options=IN_FOLDER), capsys)
    assert "files in outputs/paper: response.csv is the table P -> E, report.json has every number" in text
    assert "open outputs/paper/report.html in a browser, or pipeline view outputs/paper" in text
    assert "--verbose" in text


def test_failed_verdicts_are_named_with_their_reason(capsys):
    text = printed(print_summary, result_of(PAPER_SPRINGS), capsys)
    assert text.startswith("failed  twintip · paper: of 9 verdicts 2 failed\n")
    assert (
        "failed P_max: force ratio at E_max of a level sensor on flat fruit; tolerance relative to the target" in text
    )
    assert "failed NL: departure of P from its straight line, mid-range" in text


def test_springs_that_cannot_be_made_say_why(capsys):
    result = result_of(made=False)
    text = printed(print_summary, result, capsys)
    for spring in result.springs.springs:
        assert f"{spring.name} spring: {1e3 * spring.target:.6g} N/m, not made" in text
    assert "failed printable.low: leaf too long" in text


def test_what_failed_comes_before_what_is_undecided_and_the_rest_is_counted(capsys):
    outcomes = {"geometry.a": None, "geometry.b": None, "geometry.c": False, "geometry.d": False, "geometry.e": None}
    result = with_verdicts(result_of(), *(wrong(name, passed) for name, passed in outcomes.items()))
    lines = printed(print_summary, result, capsys).splitlines()
    said = [line for line in lines if line.startswith(("failed geometry", "undecided geometry"))]
    assert said == ["failed geometry.c: why", "failed geometry.d: why", "undecided geometry.a: why"]
    assert "and 2 more: --verbose lists them all" in lines
    assert lines[0] == "failed  twintip · paper: of 14 verdicts 2 failed, 3 undecided"


def test_one_undecided_verdict_leaves_the_answer_undecided(capsys):
    text = printed(print_summary, with_verdicts(result_of(), wrong("geometry.a", None)), capsys)
    assert text.startswith("undecided  twintip · paper: of 10 verdicts 1 undecided\n")


def test_everything_has_every_verdict_error_response_and_cost(default_run, capsys):
    text = printed(print_everything, default_run.result, capsys)
    assert [verdict.name for verdict in default_run.result.verdicts if f" {verdict.name} " not in text] == []
    for word in ("error of", "left out of the model %", "P last", "seconds (wall/processor): contact", "bruise: mean"):
        assert word in text
    assert "the paper's springs, 753 and 17300 N/m, under the same contact" in text
    assert "springs, --tol 0.001: mesh of scale" in text
    assert max(map(len, text.splitlines())) <= WIDTH


def test_everything_of_springs_that_were_not_made_is_printed_too(capsys):
    text = printed(print_everything, result_of(made=False), capsys)
    assert "failed printable.low: leaf too long" in text


def test_another_fruit_has_no_papers_springs(capsys):
    text = printed(print_everything, result_of(Design(fruit=Fruit(height_mm=20.0))), capsys)
    assert "the paper's springs" not in text


def test_brackets_in_a_reason_are_printed_as_they_are(capsys):
    text = printed(print_summary, with_verdicts(result_of(), wrong("geometry.a", False, "x [mm] and [red]")), capsys)
    assert "failed geometry.a: x [mm] and [red]" in text


def test_verdicts_on_a_file_are_a_table_with_their_reasons(capsys):
    print_verdicts("a [b].stl", [GOOD, wrong("geometry.wall", None, "too thin to say")])
    text = capsys.readouterr().out
    assert "a [b].stl" in text
    assert "undecided geometry.wall: too thin to say" in text


def test_a_tolerance_that_is_a_share_is_printed_in_per_cent(capsys):
    text = printed(print_summary, result_of(), capsys)
    rows = {line.split("│")[1].strip(): line.split("│")[5].strip() for line in text.splitlines() if "│" in line}
    assert (rows["P_max"], rows["NL"], rows["K_l"]) == ("1 %", "0.001", "0.1 %")
