"""The page of extreme designs: the same designs for a seed, and every kind of bad end of a run is seen."""

import json
from pathlib import Path

import pytest
from scripts import loaded_script

from pipeline.bench.resources import ResourceUsage
from pipeline.options import load_design

SCRIPT = Path(__file__).with_name("extremes.py")
FOLLOWS = [{"name": "report.numbers", "passed": True, "reference": ""}]
REFUSED = "pipeline: tips.side_mm = 3 mm: must be less\n"


@pytest.fixture
def extremes():
    return loaded_script(SCRIPT)


def used(code: int = 0, err: str = "", out: str = "", memory: float = 500.0) -> ResourceUsage:
    return ResourceUsage(exit_code=code, wall=3.0, cpu=2.0, peak_MiB=memory, out=out, err=err)


@pytest.fixture
def ended(extremes, monkeypatch, tmp_path):
    """Return a function that runs the script on a planted run, report and check, and returns its code and its page."""

    def run(a_run: ResourceUsage, report: str = "{}", check: ResourceUsage | None = None) -> tuple[int, str]:
        def stand_in(words):
            if words[0] == "check":
                return check or used(out=json.dumps(FOLLOWS))
            folder = Path(words[words.index("--out") + 1])
            folder.mkdir()
            (folder / "report.json").write_text(report, encoding="utf-8")
            return a_run

        monkeypatch.setattr(extremes, "limited", stand_in)
        code = extremes.main(["--count", "1", "--out", str(tmp_path)])
        return code, (tmp_path / "extremes.md").read_text(encoding="utf-8")

    return run


def test_designs_follow_the_seed_and_are_designs(extremes):
    drawn = [extremes.random_design(seed, number) for seed, number in ((1, 0), (1, 1), (2, 0))]
    assert drawn[0] == extremes.random_design(1, 0)
    assert len({json.dumps(one) for one in drawn}) == 3
    for settings in drawn:
        load_design("paper", settings)


@pytest.mark.parametrize(
    ("code", "row"),
    [(0, "| every verdict passed | 1 | 3 | 500 |"), (1, "| a verdict failed or undecided | 1 | 3 | 500 |")],
)
def test_run_that_ends_well_is_counted_with_its_cost(code, row, ended):
    result, page = ended(used(code))
    assert result == 0
    assert row in page
    assert "| with a fault | 0 |" in page


def test_refusal_is_counted_under_what_it_names(ended):
    result, page = ended(used(2, REFUSED))
    assert result == 0
    assert "| `tips.side_mm` | 1 |" in page


@pytest.mark.parametrize(
    ("a_run", "words"),
    [
        (used(124), "took more than 300 s"),
        (used(-11), "exit code -11"),
        (used(1, "Traceback (most recent call last):\nValueError: P = nan\n"), "traceback: ValueError: P = nan"),
        (used(2, "pipeline: one\nand another\n"), "stderr: pipeline: one"),
        (used(0, memory=5000.0), "memory 5000 MiB"),
    ],
)
def test_planted_bad_end_of_a_run_is_a_fault(a_run, words, ended):
    result, page = ended(a_run)
    assert result == 1
    assert f"- design 0: {words}" in page


def test_planted_infinity_and_a_report_that_disagrees_are_faults(ended):
    result, page = ended(used(), '{"a": [1.0, {"b": Infinity}]}')
    assert (result, "report.a[1].b is not finite" in page) == (1, True)
    wrong = [{"name": "report.verdicts", "passed": False, "reference": "P_max"}]
    result, page = ended(used(), check=used(1, out=json.dumps(wrong)))
    assert (result, "check, report.verdicts: P_max" in page) == (1, True)
    result, page = ended(used(), check=used(3, "died\n"))
    assert (result, "check, exit code 3: died" in page) == (1, True)
