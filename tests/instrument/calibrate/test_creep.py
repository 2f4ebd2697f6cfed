"""Tables of weights with times: a planted creep comes back, a planted fault is named."""

import re
from dataclasses import replace

import numpy as np
import pytest

from instrument.calibrate.calibration import calibrate_unit, measured_print
from instrument.press.fruit_scale import FruitScale
from instrument.press.printed_unit import read_unit, unit_as_toml
from sensor.design.parameters import Print
from sensor.design.processes import PROCESSES
from sensor.quantity import STANDARD_GRAVITY, InputError
from sensor.theory.creep import NO_CREEP

HEADER = "tip,weight_g,t_s,deflection_mm"
TIMES = (3.0, 10.0, 30.0, 100.0)
LOADS = {"low": (10.0, 30.0, 50.0), "high": (100.0, 250.0, 400.0)}


def table(measured, per_decade, times=TIMES, digits=9, counts=False):
    """Return a table of weights that hang alone, each read at some times, on springs of K after a second."""
    n = np.log10(1.0 + per_decade)
    names = [tip.name for tip in measured.report.tips]
    rows = [HEADER + (",counts_l,counts_h" if counts else "")]
    for name, K in zip(names, measured.K.tolist(), strict=True):
        for load in (0.0, *LOADS[name], 0.0):
            for t in times if load else times[:1]:
                shown = 0.002 + 1e-3 * load * STANDARD_GRAVITY / K * t**n
                of_channels = [str(round(1e6 * shown * (name == other)) + 777) for other in names]
                rows.append(
                    ",".join([name, f"{load}", f"{t}", f"{shown:.{digits}f}", *(of_channels if counts else [])])
                )
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize("per_decade", [0.011, 0.06])
@pytest.mark.parametrize("counts", [False, True])
def test_planted_creep_comes_back_with_the_stiffness_of_its_time(per_decade, counts, paper, calibrate):
    found = calibrate(paper.report, table(paper, per_decade, counts=counts))
    assert found.weighing.own
    assert found.unit.creep_per_decade == pytest.approx(per_decade, rel=1e-3 if counts else 1e-6)
    after = found.unit.weighed_after_s
    assert after == pytest.approx(np.exp(np.mean(np.log(TIMES))), rel=1e-12)
    K = paper.K / after ** np.log10(1.0 + per_decade)
    assert found.unit.stiffnesses == pytest.approx(K.tolist(), rel=1e-5)
    process = PROCESSES["fdm-petg"]
    assert found.unit.creep_error == pytest.approx(0.5 * process.creep_scatter, rel=0.01)


def test_a_dial_of_a_micrometre_tells_it_within_its_bar(paper, calibrate, rng):
    head, *rows = table(paper, 0.04, times=(2.0, 5.0, 15.0, 40.0, 120.0)).splitlines()
    cells = [row.split(",") for row in rows]
    noisy = [[*row[:3], f"{float(row[3]) + 2e-4 * rng.standard_normal():.3f}"] for row in cells]
    found = calibrate(paper.report, "\n".join([head, *map(",".join, noisy)])).unit
    assert abs(found.creep_per_decade - 0.04) < 2.0 * found.creep_error
    assert found.creep_error < PROCESSES["fdm-petg"].creep_scatter


def test_times_that_tell_less_than_the_process_leave_its_law(paper, calibrate):
    """Half a second between two readings to 0.01 mm."""
    found = calibrate(paper.report, table(paper, 0.03, times=(20.0, 31.0), digits=2))
    assert not found.weighing.own
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
    head, *rows = table(paper, 0.03).splitlines()
    turned = []
    for row in rows:
        name, load, t, shown = row.split(",")
        sign = signs[float(load) == LOADS[name][1]]
        turned.append(f"{name},{sign * float(load)},{t},{sign * (float(shown) - 0.002) + 0.002:.9f}")
    found = calibrate(paper.report, "\n".join([head, *turned])).unit
    of_pushed = calibrate(paper.report, table(paper, 0.03)).unit
    assert found.stiffnesses == pytest.approx(of_pushed.stiffnesses, rel=1e-5)
    assert found.creep_per_decade == pytest.approx(0.03, rel=1e-5)


def test_one_time_for_each_weight_is_a_time_and_no_creep(paper, calibrate):
    found = calibrate(paper.report, table(paper, 0.025, times=(60.0,)))
    assert (found.weighing.own, found.unit.creep_per_decade) == (False, None)
    assert found.unit.weighed_after_s == pytest.approx(60.0)


def test_creep_widens_what_a_unit_leaves_open(paper, calibrate):
    """A spread that is unknown moves E as much: K alone is told to 0.01 %."""
    unit = calibrate(paper.report, table(paper, 0.025))
    left = unit.unit.creep_or(paper.design.process.creep).deviation(unit.unit.weighed_after_s, 3.0)
    assert [row.u for row in unit.table] == pytest.approx(7 * [2.0 * left], rel=0.02)


@pytest.mark.parametrize(
    ("row", "cell"),
    [
        (5, "2.0"),  # before the row above of the same weight
        (5, "nan"),
        (5, "-10"),
        (3, "0"),
        (5, "4e7"),  # more than a year
        (5, ""),
    ],
)
def test_a_time_that_is_none_is_named(row, cell, paper, calibrate):
    lines = table(paper, 0.025).splitlines()
    cells = lines[row - 1].split(",")
    lines[row - 1] = ",".join([*cells[:2], cell, *cells[3:]])
    with pytest.raises(InputError) as caught:
        calibrate(paper.report, "\n".join(lines))
    assert f"line {row}, column 't" in caught.value.field
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("after", [None, 600.0])
def test_times_do_nothing_to_metal(after, paper, tmp_path):
    design = replace(paper.design, print=replace(paper.design.print, process="dmls-17-4ph"))
    report = replace(paper.report, design=design)
    path = tmp_path / "weights.csv"
    text = table(paper, 0.0, times=(3.0, 30.0))
    path.write_text(
        text if after is None else re.sub(r",(t_s|[\d.]+)(,[^,]+)$", r"\2", text, flags=re.M), encoding="utf-8"
    )
    found = calibrate_unit(report, measured_print(path, report), after_s=after)
    assert (found.stiffened, found.weighing.creep) == (1.0, NO_CREEP)
    assert found.unit.stiffnesses == pytest.approx(paper.K.tolist(), rel=1e-5)
    assert found.unit.creep_per_decade is None


@pytest.mark.parametrize("per_decade", [-0.05, 1.5])
def test_a_spring_that_stiffens_or_flows_is_refused(per_decade, paper, calibrate):
    with pytest.raises(InputError) as caught:
        calibrate(paper.report, table(paper, per_decade))
    assert caught.value.value == pytest.approx(per_decade, abs=1e-3)


def test_a_dead_channel_and_a_spring_that_stays_are_named_beside_times(paper, calibrate):
    """By the checks that name them without times: nothing divides by what did not move."""
    head, *rows = table(paper, 0.025, counts=True).splitlines()
    cells = [row.split(",") for row in rows]
    for column, name in ((4, "counts_l"), (3, "low")):
        dead = [[*row[:column], "5", *row[column + 1 :]] for row in cells]
        with pytest.raises(InputError) as caught:
            calibrate(paper.report, "\n".join([head, *map(",".join, dead)]))
        assert name in caught.value.field


@pytest.mark.parametrize(("line", "column", "name"), [(8, 3, "deflection"), (11, 4, "counts_l")])
def test_a_row_that_does_not_fit_is_named_with_its_number_as_written(line, column, name, paper, calibrate, tmp_path):
    lines = table(paper, 0.025, counts=True).splitlines()
    cells = lines[line - 1].split(",")
    cells[column] = "7"
    lines[line - 1] = ",".join(cells)
    with pytest.raises(InputError) as caught:
        calibrate(paper.report, "\n".join(lines))
    assert caught.value.field == f"{tmp_path / 'measured.csv'}, line {line}, column {name!r}"
    assert caught.value.value == 7.0


def test_unit_of_an_earlier_version_creeps_as_its_process(paper, calibrate, tmp_path):
    unit = calibrate(paper.report, table(paper, 0.03)).unit
    path = tmp_path / "unit.toml"
    text = unit_as_toml(unit)
    path.write_text(text, encoding="utf-8")
    assert read_unit(path, paper.report) == unit
    keys = ("weighed_after_s", "creep_per_decade", "creep_error")
    path.write_text("\n".join(line for line in text.splitlines() if not line.startswith(keys)), encoding="utf-8")
    old = read_unit(path, paper.report)
    assert (old.weighed_after_s, old.creep_or(paper.design.process.creep)) == (30.0, PROCESSES["fdm-petg"].creep)

    # Its scale of firmness belongs to moduli that were read without a time.
    scale = FruitScale(percent=5.0, E_MPa=(0.5, 3.0), firmness=(10.0, 60.0))
    path.write_text(unit_as_toml(replace(old, scale=scale)), encoding="utf-8")
    assert read_unit(path, paper.report).scale == scale
    kept = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith(keys)]
    path.write_text("\n".join(kept), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_unit(path, paper.report)
    assert caught.value.field == "unit.scale"
    path.write_text(text.replace("creep_error", "creep_errors"), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_unit(path, paper.report)
    assert caught.value.field in ("--unit", "unit.creep_error")
