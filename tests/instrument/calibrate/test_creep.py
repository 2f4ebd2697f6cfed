"""Tables of weights with times: a planted creep comes back, a planted fault is named."""

import re
from dataclasses import replace

import numpy as np
import pytest
from refusal import refusal

from instrument.calibrate.calibration import calibrate_unit, read_print_table
from instrument.press.fruit_scale import FruitScale
from instrument.press.printed_unit import read_unit, unit_as_toml
from sensor.design.parameters import Print
from sensor.design.processes import PROCESSES
from sensor.quantity import STANDARD_GRAVITY
from sensor.theory.creep import NO_CREEP

TIMES = (3.0, 10.0, 30.0, 100.0)
LOADS = {"low": (10.0, 30.0, 50.0), "high": (100.0, 250.0, 400.0)}


def rows_of(measured, per_decade, times=TIMES, digits=9):
    """Return rows of weights that hang alone, each read at some times, on springs of K after a second; with counts."""
    n = np.log10(1.0 + per_decade)
    rows = []
    for tip, (name, K) in enumerate(zip(LOADS, measured.K.tolist(), strict=True)):
        for load in (0.0, *LOADS[name], 0.0):
            for t in times if load else times[:1]:
                shown = 0.002 + 1e-3 * load * STANDARD_GRAVITY / K * t**n
                counts = [round(1e6 * shown * (tip == other)) + 777 for other in range(2)]
                rows.append([name, load, t, f"{shown:.{digits}f}", *counts])
    return rows


def text_of(rows, columns=4):
    """Return the first columns of a table: four without, six with counts."""
    head = ["tip", "weight_g", "t_s", "deflection_mm", "counts_l", "counts_h"]
    return "\n".join(",".join(map(str, row[:columns])) for row in [head, *rows]) + "\n"


def table(*of, counts=False, **more):
    return text_of(rows_of(*of, **more), 6 if counts else 4)


@pytest.mark.parametrize("per_decade", [0.011, 0.06])
@pytest.mark.parametrize("counts", [False, True])
def test_planted_creep_comes_back_with_the_stiffness_of_its_time(per_decade, counts, paper, calibrate):
    found = calibrate(paper.report, table(paper, per_decade, counts=counts))
    assert found.weighing.is_measured
    assert found.unit.creep_per_decade == pytest.approx(per_decade, rel=1e-3 if counts else 1e-6)
    after = found.unit.weighed_after_s
    assert after == pytest.approx(np.exp(np.mean(np.log(TIMES))), rel=1e-12)
    K = paper.K / after ** np.log10(1.0 + per_decade)
    assert found.unit.stiffnesses == pytest.approx(K.tolist(), rel=1e-5)
    process = PROCESSES["fdm-petg"]
    assert found.unit.creep_error == pytest.approx(0.5 * process.creep_scatter, rel=0.01)


def test_a_dial_of_a_micrometre_tells_it_within_its_bar(paper, calibrate, rng):
    rows = rows_of(paper, 0.04, times=(2.0, 5.0, 15.0, 40.0, 120.0))
    for row in rows:
        row[3] = f"{float(row[3]) + 2e-4 * rng.standard_normal():.3f}"
    found = calibrate(paper.report, text_of(rows)).unit
    assert abs(found.creep_per_decade - 0.04) < 2.0 * found.creep_error
    assert found.creep_error < PROCESSES["fdm-petg"].creep_scatter


def test_times_that_tell_less_than_the_process_leave_its_law(paper, calibrate):
    """Half a second between two readings to 0.01 mm."""
    found = calibrate(paper.report, table(paper, 0.03, times=(20.0, 31.0), digits=2))
    assert not found.weighing.is_measured
    assert (found.unit.creep_per_decade, found.unit.creep_error) == (None, None)
    assert any("creep" in note for note in found.assumed)


def test_creep_is_found_of_a_process_that_tells_none(paper, calibrate):
    """A printer of one's own; where the table shows no more than its error, the springs stay elastic."""
    petg = PROCESSES["fdm-petg"]
    sources = tuple((key, source) for key, source in petg.sources if not key.startswith("creep"))
    mine = replace(petg, name="mine", sources=sources, creep_per_decade=None, creep_scatter=None)
    report = replace(paper.report, design=replace(paper.design, print=Print(process="mine"), printer=mine))
    found = calibrate(report, table(paper, 0.03)).unit
    assert found.creep_per_decade == pytest.approx(0.03, rel=1e-6)
    still = calibrate(report, table(paper, 0.0, digits=2)).unit
    assert (still.creep_per_decade, still.creep_error) == (None, None)


@pytest.mark.parametrize("signs", [(-1, -1), (1, -1)])
def test_weights_that_pull_tell_the_same_spring(signs, paper, calibrate):
    """Of a spring that hangs upside down, or is pressed and pulled: K and creep are those of the weights' sizes."""
    rows = rows_of(paper, 0.03)
    for row in rows:
        sign = signs[row[1] == LOADS[row[0]][1]]
        row[1], row[3] = sign * row[1], f"{sign * (float(row[3]) - 0.002) + 0.002:.9f}"
    found = calibrate(paper.report, text_of(rows)).unit
    of_pushed = calibrate(paper.report, table(paper, 0.03)).unit
    assert found.stiffnesses == pytest.approx(of_pushed.stiffnesses, rel=1e-5)
    assert found.creep_per_decade == pytest.approx(0.03, rel=1e-5)


def test_one_time_for_each_weight_is_a_time_and_no_creep(paper, calibrate):
    found = calibrate(paper.report, table(paper, 0.025, times=(60.0,)))
    assert (found.weighing.is_measured, found.unit.creep_per_decade) == (False, None)
    assert found.unit.weighed_after_s == pytest.approx(60.0)


def test_creep_widens_what_a_unit_leaves_open(paper, calibrate):
    """A spread that is unknown moves E as much: K alone is told to 0.01 %."""
    unit = calibrate(paper.report, table(paper, 0.025))
    left = unit.unit.measured_creep_or(paper.design.process.creep).deviation(unit.unit.weighed_after_s, 3.0)
    assert [row.u for row in unit.table] == pytest.approx(7 * [2.0 * left], rel=0.02)


@pytest.mark.parametrize(
    ("lines", "column", "cell", "place"),
    [
        ([5], 2, "2.0", ", line 5, column 't'"),  # before the row above of the same weight
        ([5], 2, "-10", ", line 5, column 't'"),
        ([3], 2, "0", ", line 3, column 't'"),
        ([5], 2, "4e7", ", line 5, column 't_s'"),  # more than a year
        ([8], 3, "7", ", line 8, column 'deflection'"),
        ([11], 4, "7", ", line 11, column 'counts_l'"),
        (range(2, 30), 3, "5", ": compliance of low"),  # nothing divides by what did not move
        (range(2, 30), 4, "5", ": counts_l against the weight on low"),
    ],
)
def test_what_is_wrong_beside_times_is_named_as_it_is_written(lines, column, cell, place, paper, calibrate, tmp_path):
    rows = rows_of(paper, 0.025)
    for line in lines:
        rows[line - 2][column] = cell
    told = refusal(calibrate, paper.report, text_of(rows, max(column + 1, 4) if column < 4 else 6))
    assert told.field == f"{tmp_path / 'measured.csv'}{place}"
    assert cell != "7" or told.value == 7.0


@pytest.mark.parametrize("after", [None, 600.0])
def test_times_do_nothing_to_metal(after, paper, tmp_path):
    design = replace(paper.design, print=replace(paper.design.print, process="dmls-17-4ph"))
    report = replace(paper.report, design=design)
    path = tmp_path / "weights.csv"
    text = table(paper, 0.0, times=(3.0, 30.0))
    if after is not None:
        text = re.sub(r"^([^,]+,[^,]+),[^,]+", r"\1", text, flags=re.M)  # without times
    path.write_text(text, encoding="utf-8")
    found = calibrate_unit(report, read_print_table(path, report), after_s=after)
    assert (found.stiffened, found.weighing.creep) == (1.0, NO_CREEP)
    assert found.unit.stiffnesses == pytest.approx(paper.K.tolist(), rel=1e-5)
    assert found.unit.creep_per_decade is None


@pytest.mark.parametrize("per_decade", [-0.05, 1.5])
def test_a_spring_that_stiffens_or_flows_is_refused(per_decade, paper, calibrate):
    assert refusal(calibrate, paper.report, table(paper, per_decade)).value == pytest.approx(per_decade, abs=1e-3)


def test_unit_of_an_earlier_version_creeps_as_its_process(paper, calibrate, tmp_path):
    """Its scale of firmness belongs to moduli that were read without a time."""
    keys = ("weighed_after_s", "creep_per_decade", "creep_error")
    path = tmp_path / "unit.toml"

    def read_again(unit, left_out=()):
        lines = unit_as_toml(unit).splitlines()
        path.write_text("\n".join(line for line in lines if not line.startswith(left_out)), encoding="utf-8")
        return read_unit(path, paper.report)

    unit = calibrate(paper.report, table(paper, 0.03)).unit
    assert read_again(unit) == unit
    old = read_again(unit, keys)
    assert (old.weighed_after_s, old.measured_creep_or(paper.design.process.creep)) == (
        30.0,
        PROCESSES["fdm-petg"].creep,
    )
    scaled = replace(old, scale=FruitScale(percent=5.0, E_MPa=(0.5, 3.0), firmness=(10.0, 60.0)))
    assert read_again(scaled) == scaled
    assert refusal(read_again, scaled, keys).field == "unit.scale"
