"""Prints that miss their drawing: stiffness by the beam law, and the verdicts of the sensor that came out."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from cad.quantity import InputError
from cad.theory.two_spring_law import Springs
from pipeline.cli import main
from pipeline.options import load_design
from pipeline.springs.sizing import SpringSizing
from pipeline.study import read_study, run_study
from pipeline.study.levels.printed import PrintMiss, print_miss, printed_sizing
from pipeline.study.store import stored_study
from pipeline.study.workers import Engine

Write = Callable[..., Path]

DRAWN = SpringSizing(
    springs=Springs(K_l=0.9, K_h=20.0),
    K_m_over_E=1.3,
    K_m_max=4.55,
    K_m_max_contact=4.55,
    K_m_at_largest_E=4.55,
    stiffness_ratio=1.0,
    sizing_stiffness_ratio=1.0,
    basis="contact",
)
TEXT = """
base = "paper"
samples = 1024
seed = 1
contact = "solve"
wanted = ["springs.K_l_N_per_m", "verdicts.P_max.value", "verdicts.P_max.passed", "verdicts.printable.low.value"]
[vary]
"printed.thickness_offset_mm" = { mean = 0.0, sd = 0.025, source = "accuracy_mm of fdm-petg, two sigma" }
"printed.E_offset" = { mean = 0.0, sd = 0.1, source = "E_scatter of fdm-petg" }
"""


def test_springs_of_a_print_follow_the_cube_of_each_leaf_and_the_modulus() -> None:
    design = load_design("paper")  # leaves of 0.8 and 1.2 mm
    printed = printed_sizing(design, DRAWN, PrintMiss(thickness_mm=-0.1, E=0.2)).springs
    assert printed.K_l == pytest.approx(0.9 * 1.2 * (0.7 / 0.8) ** 3, rel=1e-12)
    assert printed.K_h == pytest.approx(20.0 * 1.2 * (1.1 / 1.2) ** 3, rel=1e-12)
    assert printed_sizing(design, DRAWN, PrintMiss()) == DRAWN


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"printed.thickness_offset_mm": -0.8}, "printed.thickness_offset_mm = -0.8 mm: must be greater than -0.8 mm"),
        ({"printed.E_offset": -1.0}, "printed.E_offset = -1: must be greater than -1"),
        ({"printed.E_offset": "soft"}, "printed.E_offset = 'soft': must be a number"),
    ],
)
def test_print_of_which_nothing_is_left_is_refused(settings: Mapping[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        printed_sizing(load_design("paper"), DRAWN, print_miss(settings))


def test_gauged_leaves_follow_another_law_and_are_refused() -> None:
    gauged = load_design("paper", {"print.gauges": "foil"})
    with pytest.raises(InputError, match=r"print\.gauges = 'foil': must be none"):
        printed_sizing(gauged, DRAWN, PrintMiss(E=0.1))


def test_prints_scatter_as_the_law_says_and_their_verdicts_tell(written: Write, engine: Engine, tmp_path: Path) -> None:
    assert run_study(read_study(written(TEXT)), tmp_path / "out", engine).done == 1024
    with stored_study(tmp_path / "out") as store:
        rows = list(store.rows())
    drawn = next(row for row in rows if row.number == 0)
    K = np.array([row.values["springs.K_l_N_per_m"] for row in rows])
    d, e = (np.array([row.settings[key] for row in rows]) for key in drawn.settings)
    nominal = K / ((1.0 + e) * (1.0 + d / 0.8) ** 3)
    assert np.ptp(nominal) < 1e-9 * nominal[0]
    # E[(1 + e) (1 + s)^3] = 1 + 3 var(s) of independent normal e and s; the mean of n points is off by sd / sqrt(n)
    assert K.mean() / nominal[0] == pytest.approx(1.0 + 3.0 * (0.025 / 0.8) ** 2, abs=3.0 * 0.14 / 32.0)
    passed = [row.values["verdicts.P_max.passed"] for row in rows]
    P_max = np.array([row.values["verdicts.P_max.value"] for row in rows])
    assert [bool(one) for one in passed] == [abs(value / 5.0 - 1.0) <= 0.01 for value in P_max.tolist()]
    assert True in passed
    assert False in passed
    assert len({row.values["verdicts.printable.low.value"] for row in rows}) == 1  # of the drawing, not of a print


def test_prints_with_flexures_are_refused(written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(TEXT.replace('"springs.K_l_N_per_m"', '"flexures.low.stiffness_N_per_m"'))
    assert main(["study", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "level = 'flexures': must be contact where printed.thickness_offset_mm varies" in capsys.readouterr().err
