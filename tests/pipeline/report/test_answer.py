"""The answer of a run is drawn from report.json: one screen, or every table; an unchanged folder answers the same."""

import dataclasses
import json
import re
from pathlib import Path

import pytest
from programs import PYTHON, ended
from stand_ins import GOOD, print_everything, print_summary, result_of

import pipeline
from pipeline import options
from pipeline.options import RunOptions
from pipeline.report.outputs import write_outputs
from pipeline.report.verdict_table import WIDTH, print_parts, verdict_parts
from pipeline.storage.folder import output_folder
from pipeline.verdicts.in_words import fails_only_by_unread_poses, in_display_units, measured
from sensor.quantity import Estimate
from sensor.verdict import Verdict, judge
from twintip.cli import main

UNNEEDED = {"numpy", "scipy", "cadquery", "gmsh", "skfem", "matplotlib", "vtkmodules", "trimesh", "cattrs", "loky"}
MOST_LINES = 24  # of a terminal as it opens
RESULT = result_of()


@pytest.fixture
def runs(tmp_path, monkeypatch):
    """Return the list of designs that were run, in an empty current folder."""
    designs = []

    def run(design, options, **_):
        designs.append(design)
        result = dataclasses.replace(
            RESULT, pressed=dataclasses.replace(RESULT.pressed, design=design), options=options
        )
        with output_folder(options.out, force=options.force) as folder:
            (folder / "part.step").write_text(f"part {len(designs)}")
            report = write_outputs(result, folder)
        return dataclasses.replace(result, report=report)

    monkeypatch.setattr(pipeline, "run", run)
    monkeypatch.chdir(tmp_path)
    return designs


@pytest.mark.slow
def test_unchanged_run_answers_the_same_and_imports_nothing_that_solves(default_run):
    before = {path.name: path.read_bytes() for path in default_run.folder.iterdir()}
    program = f"""if True:
        import sys
        from twintip.cli import main
        code = main(["run", "--nl", "0.05", "--out", {str(default_run.folder)!r}])
        print(*sorted({UNNEEDED!r} & set(sys.modules)), file=sys.stderr)
        sys.exit(code)
    """
    done = ended(PYTHON, "-c", program)
    assert (done.returncode, done.stderr, done.stdout) == (default_run.code, "\n", default_run.printed)
    assert {path.name: path.read_bytes() for path in default_run.folder.iterdir()} == before


@pytest.mark.parametrize(
    ("words", "count"),
    [
        ([], 1),
        (["--json"], 1),
        (["--force"], 1),
        (["--nl", "0.06"], 2),
        (["--fields"], 2),
    ],
    ids=str,
)
def test_only_another_design_or_option_runs_again(words, count, runs, capsys):
    main(["run", "--out", "out"])
    capsys.readouterr()
    main(["run", "--out", "out", *words])
    assert len(runs) == count
    if words == ["--json"]:
        assert json.loads(capsys.readouterr().out) == json.loads(Path("out/report.json").read_bytes())


def test_another_command_program_page_date_or_a_changed_folder_runs_again(runs, monkeypatch):
    main(["run", "--out", "out"])
    Path("out").rename("moved")
    main(["run", "--out", "moved"])
    assert len(runs) == 1
    main(["design", "--out", "moved"])
    assert len(runs) == 2
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1600000000")
    main(["design", "--out", "moved"])
    assert len(runs) == 3
    monkeypatch.setattr(options, "code_digest", lambda: "another program")
    main(["design", "--out", "moved"])
    assert len(runs) == 4
    monkeypatch.setattr(options, "pages_digest", lambda: "another plot")
    main(["design", "--out", "moved"])
    assert len(runs) == 5
    Path("moved/part.step").unlink()
    main(["design", "--out", "moved"])
    assert len(runs) == 6


def with_verdicts(result, *verdicts):
    return dataclasses.replace(result, verdicts=(*result.verdicts, *verdicts))


def failed(name):
    return dataclasses.replace(GOOD, name=name, passed=False, reference="why")


@pytest.mark.parametrize(
    "result",
    [
        result_of(made=False),
        with_verdicts(RESULT, *(failed(f"geometry.wall_{n}") for n in range(40))),
    ],
    ids=["not made", "forty failed"],
)
def test_answer_fits_one_screen_whatever_failed(result, capsys):
    result = dataclasses.replace(result, options=RunOptions(out=Path("outputs/paper")))
    print_summary(result)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= MOST_LINES
    assert max(map(len, lines)) <= WIDTH


def test_a_failed_verdict_on_the_part_shows_its_value_and_limit(capsys):
    """No row of the table does, unlike for a target."""
    sideways = judge("sideways.high", Estimate(1.02, 0.01), "why", limit=1.2)
    print_summary(with_verdicts(RESULT, sideways, failed("P_max")))
    out = capsys.readouterr().out
    assert "failed sideways.high: 1.020 ± 0.010, must be ≥ 1.2; why" in out
    assert "failed P_max: why" in out


def test_rest_of_the_verdicts_is_counted(capsys):
    """Those on the part are one row with their number and how many passed; without any there is no such row."""
    counts = r"│ (\d+) on geometry and print .* (\d+) passed"
    wrong = [failed(f"geometry.wall_{n}") for n in range(2)]
    print_summary(with_verdicts(RESULT, *wrong))
    assert re.findall(counts, capsys.readouterr().out) == [("5", "3")]  # both leaves and the solid passed
    targets = tuple(verdict for verdict in RESULT.verdicts if verdict.name in ("P_max", "NL"))
    print_summary(dataclasses.replace(RESULT, verdicts=targets))
    assert re.findall(counts, capsys.readouterr().out) == []


@pytest.mark.parametrize(("value", "shown"), [(2.6e-16, "0 %"), (2.6e-9, "2.6e-07 %")])
def test_round_off_is_shown_as_none(value, shown, capsys):
    print_parts(verdict_parts("", [dataclasses.replace(GOOD, name="P_displacement_independent", value=value)]))
    (row,) = (line for line in capsys.readouterr().out.splitlines() if " P_displacement_independent " in line)
    assert row.split("│")[2].strip() == shown


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("reading.uncertainty", 200.0),
        ("unit.uncertainty", 200.0),
        ("reading.bias", 100.0),
        ("P_max", 1.0),
    ],
)
def test_verdict_is_read_at_95_per_cent_with_its_limit_in_the_same_measure(name, factor):
    """A standard uncertainty is half of what holds 95 %; a bias and a target have no such measure."""
    verdict = Verdict(
        name=name, value=0.12, error=0.001, limit=0.15, unit="1", tolerance=0.0, passed=True, reference=""
    )
    shown = in_display_units(verdict)
    assert (shown.value, shown.error, shown.limit) == pytest.approx((0.12 * factor, 0.001 * factor, 0.15 * factor))
    assert shown.unit == ("1" if factor == 1.0 else "%")


def test_everything_has_every_verdict(capsys):
    print_everything(RESULT)
    text = " ".join(capsys.readouterr().out.split())
    for verdict in (*RESULT.verdicts, *RESULT.paper):
        assert f" {verdict.name} " in text
        assert measured(in_display_units(verdict)) in text


@pytest.mark.parametrize(
    ("name", "passed", "value", "unread"),
    [
        *((f"reading.{name}", False, 0.02, True) for name in ("bias", "relaxation")),
        ("reading.bias", False, 0.06, False),
        ("reading.bias", True, 0.02, False),
        ("unit.uncertainty", False, 0.02, False),
    ],
)
def test_reading_that_fails_within_its_limit_has_a_reason(name, passed, value, unread, capsys):
    given = {"unit": "1", "limit": 0.05, "tolerance": 0.0, "reference": "3 of 68 poses have no reading"}
    verdict = Verdict(name=name, value=value, passed=passed, **given)
    assert fails_only_by_unread_poses(verdict) is unread
    print_parts(verdict_parts("", [verdict]))
    row = next(line for line in capsys.readouterr().out.splitlines() if f" {name} " in line)
    assert ("failed: " in row) is unread


def test_hint_is_given_once(capsys):
    wrong = dataclasses.replace(failed("P_max"), remedy="passes with [x]")
    print_parts(verdict_parts("", [wrong, dataclasses.replace(wrong, name="NL")]))
    assert capsys.readouterr().out.count("passes with [x]") == 1


def test_whole_answer_has_the_reason_of_each_verdict_that_did_not_pass(capsys):
    verdicts = tuple(
        dataclasses.replace(GOOD, name=f"planted.{name}", passed=passed, reference=f"because of {name}")
        for name, passed in (("one", True), ("two", False), ("three", None))
    )
    print_everything(dataclasses.replace(RESULT, verdicts=verdicts))
    out = capsys.readouterr().out
    assert [f"because of {name}" in out for name in ("one", "two", "three")] == [False, True, True]
