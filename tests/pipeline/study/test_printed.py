"""Prints that miss their drawing: stiffness by the beam law, and the verdicts of the sensor that came out."""

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from cad.quantity import InputError
from cad.theory.two_spring_law import Springs, size_springs
from pipeline.options import RunOptions, load_design
from pipeline.response.contact import fruit_compliance
from pipeline.springs.sizing import SpringSizing
from pipeline.study import read_study, run_study
from pipeline.study.printed import printed_sizing
from pipeline.study.store import stored_study
from pipeline.study.workers import Engine

THICKNESS, MODULUS = "printed.thickness_offset_mm", "printed.E_offset"
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
samples = 64
seed = 1
wanted = ["springs.K_l_N_per_m", "verdicts.P_max.value", "verdicts.P_max.passed", "verdicts.printable.low.value"]
[vary]
"printed.thickness_offset_mm" = { mean = 0.0, sd = 0.025, source = "accuracy_mm of fdm-petg, two sigma" }
"printed.E_offset" = { mean = 0.0, sd = 0.1, source = "E_scatter of fdm-petg" }
"""


def test_springs_of_a_print_follow_the_cube_of_each_leaf_and_the_modulus() -> None:
    design = load_design("paper")  # leaves of 0.8 and 1.2 mm
    printed = printed_sizing(design, DRAWN, {THICKNESS: -0.1, MODULUS: 0.2}).springs
    assert printed.K_l == pytest.approx(0.9 * 1.2 * (0.7 / 0.8) ** 3, rel=1e-12)
    assert printed.K_h == pytest.approx(20.0 * 1.2 * (1.1 / 1.2) ** 3, rel=1e-12)
    assert printed_sizing(design, DRAWN, {"press.travel_mm": 0.5}) == DRAWN


@pytest.mark.parametrize(
    ("settings", "gauges", "field"),
    [
        ({THICKNESS: -0.8}, "none", THICKNESS),
        ({MODULUS: -1.0}, "none", MODULUS),
        ({MODULUS: "soft"}, "none", MODULUS),
        ({MODULUS: 0.1}, "foil", "print.gauges"),  # whose stiffness follows another law
    ],
)
def test_print_that_the_law_does_not_give_is_refused(settings: Mapping[str, object], gauges: str, field: str) -> None:
    with pytest.raises(InputError) as refused:
        printed_sizing(load_design("paper", {"print.gauges": gauges}), DRAWN, settings)
    assert refused.value.field == field


def test_verdicts_are_those_of_the_print_but_printable_is_that_of_the_drawing(
    written: Callable[..., Path], engine: Engine, tmp_path: Path
) -> None:
    run_study(read_study(written(TEXT)), tmp_path / "out", engine)
    with stored_study(tmp_path / "out") as store:
        rows = list(store.rows())
    K_m_max = 3.5 * fruit_compliance(load_design("paper"), RunOptions()).K_m_over_E()
    K_l = 1e3 * size_springs(5.0, 0.05, K_m_max).K_l
    for row in rows:
        print_over_drawing = (1.0 + row.settings[MODULUS]) * (1.0 + row.settings[THICKNESS] / 0.8) ** 3
        assert row.values["springs.K_l_N_per_m"] == pytest.approx(K_l * print_over_drawing, rel=1e-9)
        assert row.values["verdicts.printable.low.value"] == rows[0].values["verdicts.printable.low.value"]
        assert row.values["verdicts.P_max.passed"] == (abs(row.values["verdicts.P_max.value"] / 5.0 - 1.0) <= 0.01)
    assert {row.values["verdicts.P_max.passed"] for row in rows} == {True, False}


def test_prints_with_flexures_are_refused(written: Callable[..., Path]) -> None:
    with pytest.raises(InputError) as refused:
        read_study(written(TEXT.replace('"springs.K_l_N_per_m"', '"flexures.low.stiffness_N_per_m"')))
    assert (refused.value.field, refused.value.value) == ("level", "flexures")
