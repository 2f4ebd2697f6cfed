"""Curves that are no compression of a fruit are refused at their line; the moduli of those that are, by formula."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cad.quantity import InputError
from pipeline.measure.compression.batch import design_range, fruit_summaries, overall
from pipeline.measure.compression.modulus import CompressionResult, TestGeometry, measured_modulus
from pipeline.measure.compression.specimens import read_specimens
from pipeline.measure.compression.virtual_test import VirtualTest

BALL = TestGeometry(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
QUIET = VirtualTest(E_MPa=1.0, noise_percent=0.05, toe_mm=0.0, offset_N=0.0, failure_strain=0.11)


def measure(tmp_path: Path, text: str, geometry: TestGeometry = BALL, *, turned: bool = False) -> CompressionResult:
    path = tmp_path / "test.csv"
    path.write_text(text, encoding="utf-8")
    (specimen,) = read_specimens(path, {})
    return measured_modulus(specimen, geometry, compression_negative=turned)


def edited(change: Callable[[int, float, float], tuple[float, float]], header: str = "travel_mm,force_N") -> str:
    """Return the quiet test with every row (index, travel, force) changed."""
    rows = [change(index, x, F) for index, (x, F) in enumerate(zip(*QUIET.curve(), strict=True))]
    return f"{header}\n" + "".join(f"{x:.6f},{F:.6f}\n" for x, F in rows)


def test_paper_modulus_of_a_ball_is_that_of_the_formula(tmp_path: Path):
    """Secant c E* sqrt(D) H / A with c of two plates: 0.28, 0.45, 0.63 at 2, 5, 10 % for R 35, E 1, nu 0.3.

    The tangent is 3/2 of the secant, the law's exponent.
    """
    found = measure(tmp_path, QUIET.csv())
    by_strain = {one.strain_percent: one for one in found.secants}
    for strain, rounded in ((2.0, 0.28), (5.0, 0.45), (10.0, 0.63)):
        depth = 0.01 * strain * 70.0
        exact = 4.0 / 3.0 * np.sqrt(35.0 / 8.0) / 0.91 * np.sqrt(depth) * 70.0 / 900.0
        assert by_strain[strain].E_secant_MPa == pytest.approx(exact, rel=0.01)
        assert by_strain[strain].E_secant_MPa == pytest.approx(rounded, abs=0.006)
        assert by_strain[strain].E_tangent_MPa == pytest.approx(1.5 * exact, rel=0.02)
    assert found.E_plate_MPa == by_strain[5.0].E_secant_MPa
    assert found.reads_low == pytest.approx(1.0 / 0.447, rel=0.01)


def test_secant_lies_in_its_error_bar(tmp_path: Path):
    """The exact secant at 5 %, in 12 noisy tests of E 1."""
    exact = 4.0 / 3.0 * np.sqrt(35.0 / 8.0) / 0.91 * np.sqrt(3.5) * 70.0 / 900.0
    inside = 0
    for seed in range(12):
        test = VirtualTest(E_MPa=1.0, seed=seed)
        one = measure(tmp_path, test.csv()).secants[0]
        inside += abs(one.E_secant_MPa / exact - 1.0) <= 0.01 * one.u_secant_percent
    assert inside >= 9


@pytest.mark.parametrize(
    "header", ["travel_mm,force_mN", "travel_um,force_N", "travel_m,force_N", "travel_mm,force_kN"]
)
def test_wrong_unit_is_refused(header: str, tmp_path: Path):
    with pytest.raises(InputError, match="check the unit"):
        measure(tmp_path, edited(lambda _, x, F: (x, F), header))


@pytest.mark.parametrize("noise", [0.0, 0.05, 1.0])
def test_swapped_columns_are_refused(noise: float, tmp_path: Path):
    text = VirtualTest(E_MPa=1.0, noise_percent=noise).csv().replace("travel_mm,force_N", "force_N,travel_mm")
    with pytest.raises(InputError, match="swapped"):
        measure(tmp_path, text)


def test_negative_compression_is_refused_and_turned_by_its_flag(tmp_path: Path):
    text = edited(lambda _, x, F: (-x, -F))
    with pytest.raises(InputError, match=r"line \d+, column 'force_N' = .* --compression-negative"):
        measure(tmp_path, text)
    assert measure(tmp_path, text, turned=True).E_hertz_MPa == pytest.approx(1.0, rel=0.005)
    force_only = edited(lambda _, x, F: (x, -F))
    assert measure(tmp_path, force_only, turned=True).E_hertz_MPa == pytest.approx(1.0, rel=0.005)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda i, x, F: (x, F - 500.0 if i == 300 else F), r"line 302, column 'force_N' = -"),
        (lambda i, x, F: (x - 3.0 if 300 <= i < 500 else x, F), r"line \d+, column 'travel_mm' = .* one loading"),
        (lambda _i, x, _F: (x, 1.0), r"column 'force_N' = 1 N: must be one that rises, and all are alike"),
        (lambda _i, _x, F: (1.0, F), r"column 'travel_mm' = 1 mm: must be one that rises"),
    ],
    ids=["one force far below zero", "plate turns back", "dead load cell", "stuck travel"],
)
def test_impossible_curve_is_refused_at_its_line(change, words: str, tmp_path: Path):
    with pytest.raises(InputError, match=words):
        measure(tmp_path, edited(change))


def test_time_that_runs_backwards_is_refused_at_its_line(tmp_path: Path):
    rows = [f"{5.0 if index == 40 else index},{x},{F}" for index, (x, F) in enumerate(zip(*QUIET.curve(), strict=True))]
    with pytest.raises(
        InputError, match=r"line 42, column 'time_s' = 5 s: must be at least that of the row before, 39 s"
    ):
        measure(tmp_path, "time_s,travel_mm,force_N\n" + "\n".join(rows))


def test_few_rows_are_refused(tmp_path: Path):
    with pytest.raises(InputError, match="= 6 rows of load: must be at least 12"):
        measure(tmp_path, "\n".join(QUIET.csv().splitlines()[:7]))


def test_twenty_rows_are_enough(tmp_path: Path):
    test = VirtualTest(E_MPa=2.0, rows=20, noise_percent=0.3)
    found = measure(tmp_path, test.csv())
    assert found.E_hertz_MPa == pytest.approx(2.0, rel=0.05)


def test_unit_that_may_be_wrong_is_asked_about(tmp_path: Path):
    """Newtons called kilogram-force are 9.8 times too many: 20 MPa may be a nut, and is hardly a fruit."""
    text = VirtualTest(E_MPa=2.0).csv().replace("force_N", "force_kgf")
    assert any("unusual for a fruit: check the units" in note for note in measure(tmp_path, text).notes)


def test_lost_rows_do_not_move_the_modulus(tmp_path: Path):
    lines = QUIET.csv().splitlines()
    found = measure(tmp_path, "\n".join(lines[:250] + lines[330:]))
    assert found.E_hertz_MPa == pytest.approx(1.0, rel=0.01)


def test_seat_and_unequal_radii_change_the_modulus_by_their_formulas(tmp_path: Path):
    ball = measure(tmp_path, QUIET.csv())
    seat = TestGeometry(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0, plates=1)
    assert measure(tmp_path, QUIET.csv(), seat).E_hertz_MPa == pytest.approx(ball.E_hertz_MPa / 2.0**1.5, rel=0.01)
    larger = TestGeometry(height_mm=70.0, radius_mm=45.0, radius_across_mm=45.0)
    expected = ball.E_hertz_MPa * np.sqrt(35.0 / 45.0)
    assert measure(tmp_path, QUIET.csv(), larger).E_hertz_MPa == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(
    ("key", "value"), [("height_mm", -1.0), ("radius_mm", 0.0), ("poisson", 0.5), ("plate_area_mm2", float("nan"))]
)
def test_impossible_geometry_is_refused(key: str, value: float):
    known = {"height_mm": 70.0, "radius_mm": 35.0, "radius_across_mm": 35.0}
    with pytest.raises(InputError, match=f"modulus.{key}"):
        TestGeometry(**{**known, key: value})


def test_batch_has_mean_deviation_and_the_range_for_the_design(tmp_path: Path):
    results = []
    for folder, moduli in (("a", (0.8, 1.0)), ("b", (3.0, 3.2))):
        (tmp_path / folder).mkdir()
        for E in moduli:
            path = tmp_path / folder / f"{E}.csv"
            path.write_text(VirtualTest(E_MPa=E, noise_percent=0.05).csv(), encoding="utf-8")
            (specimen,) = read_specimens(path, {})
            results.append(measured_modulus(specimen, BALL))
    assert len(fruit_summaries(results, by_folder=False)) == 4
    summaries = fruit_summaries(results, by_folder=True)
    assert [one.count for one in summaries] == [2, 2]
    assert [one.E_hertz_MPa for one in summaries] == pytest.approx([0.9, 3.1], rel=0.005)
    assert summaries[0].E_hertz_deviation_MPa == pytest.approx(0.2 / np.sqrt(2.0), rel=0.05)
    assert overall(summaries).E_hertz_MPa == pytest.approx(2.0, rel=0.005)
    span = design_range(results)
    assert 3.2 <= span.E_max_MPa <= 3.4
    assert span.E_MPa[0] <= 0.8
    assert span.E_MPa[-1] == span.E_max_MPa
    assert len(span.E_MPa) == 7
