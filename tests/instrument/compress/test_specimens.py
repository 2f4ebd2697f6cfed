"""Files of testing machines in every layout: the same curve comes out of each."""

import numpy as np
import pytest
from refusal import refusal

from instrument.compress.specimens import QUANTITIES, read_specimens
from pipeline.tables.headers import ColumnFlags

TRAVEL = np.array([0.0, 0.5, 1.0, 1.5])  # [mm]
FORCE = np.array([0.25, 0.5, 4.0, 9.75])  # [N]
PLAIN = "0.25,0.0\n0.5,0.5\n4.0,1.0\n9.75,1.5\n"
SIDE_BY_SIDE = (
    '"1 _ 1",,,"1 _ 2",,\n"Time","Force","Stroke","Time","Force","Stroke"\n"sec","N","mm","sec","N","mm"\n'
    '"0","0.25","0","0","0.2","0"\n"0.1","0.5","0.5","0.1","0.4","0.5"\n"0.2","4.0","1.0",,,\n"0.3","9.75","1.5",,,\n'
)
SECTIONS = (
    "Name,Max._Force\n,N\n1 _ 1,9.75\n\n"
    "1 _ 1,,\nTime,Force,Stroke\nsec,N,mm\n0,0.25,0\n0.1,0.5,0.5\n0.2,4,1\n0.3,9.75,1.5\n\n"
    "1 _ 2,,\nTime,Force,Stroke\nsec,kN,mm\n0,0.001,0\n0.1,0.002,0.5\n"
)


def read(tmp_path, content, columns=None, units=None):
    path = tmp_path / "test.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_specimens(path, ColumnFlags(columns, units).applied(QUANTITIES))


def assert_is_the_curve(specimen):
    np.testing.assert_allclose(specimen.travel, TRAVEL, rtol=1e-12)
    np.testing.assert_allclose(specimen.force, FORCE, rtol=1e-12)


def test_specimens_side_by_side_end_each_at_its_own_row(tmp_path):
    first, second = read(tmp_path, SIDE_BY_SIDE)
    assert (first.name, second.name) == ("1 _ 1", "1 _ 2")
    assert_is_the_curve(first)
    np.testing.assert_allclose(second.force, [0.2, 0.4])
    np.testing.assert_allclose(second.time, [0.0, 0.1])
    assert first.lines == (4, 5, 6, 7)


def test_sections_are_specimens_with_their_own_units(tmp_path):
    first, second = read(tmp_path, SECTIONS)
    assert (first.name, second.name) == ("1 _ 1", "1 _ 2")
    assert_is_the_curve(first)
    np.testing.assert_allclose(second.force, [1.0, 2.0])


def test_unit_that_is_assumed_is_noted_and_given_by_a_flag(tmp_path):
    (assumed,) = read(tmp_path, f"force,travel\n{PLAIN}")
    assert len(assumed.notes) == 2
    (given,) = read(tmp_path, f"force,travel\n{PLAIN}", units="force=kN,travel=um")
    assert given.notes == ()
    np.testing.assert_allclose(given.force, 1e3 * FORCE)
    np.testing.assert_allclose(given.travel, 1e-3 * TRAVEL)


CURVE = [(round(0.1 * row, 1), round(0.5 * row**1.5, 3)) for row in range(30)]  # [mm, N]


def lines_of(curve, form="{F},{x}"):
    return "".join(form.format(F=F, x=x) + "\n" for x, F in curve)


RESULTS = "Specimen,Force (kN),Travel (mm)\n1,0.075,2.9\n"
STATISTICS = "Mean,0.075,2.9\nS.D.,0,0\n"
PLAIN_CURVE = "Force (N),Travel (mm)\n" + lines_of(CURVE)


@pytest.mark.parametrize(
    "content",
    [
        f"Results\n{RESULTS}\n{PLAIN_CURVE}",
        f"Results\n{RESULTS}{STATISTICS}Raw data\n{PLAIN_CURVE}",
        f"{PLAIN_CURVE}\nResults\n{RESULTS}{STATISTICS}",
        f"{PLAIN_CURVE}{RESULTS}{STATISTICS}",
        f"{RESULTS}{RESULTS.splitlines()[1]}\n" + "1,0.07,2.9\n" * 20 + STATISTICS + f"\n{PLAIN_CURVE}",
    ],
)
def test_table_of_results_is_passed_over_and_said(content, tmp_path):
    (specimen,) = read(tmp_path, content)
    np.testing.assert_allclose(specimen.force, [F for _, F in CURVE])
    assert "results" in specimen.summary


@pytest.mark.parametrize("gap", ["", "\n", "\nSamples,10\n***End_of_Header***,\n"])
@pytest.mark.parametrize("time", [False, True])
def test_segments_of_one_test_are_one_specimen(gap, time, tmp_path):
    header = "Force (N),Travel (mm)" + (",Time (s)" if time else "")
    form = "{F},{x},{x}" if time else "{F},{x}"
    parts = [f"{header}\n" + lines_of(CURVE[begin : begin + 10], form) for begin in (0, 10, 20)]
    (specimen,) = read(tmp_path, gap.join(parts))
    np.testing.assert_allclose(specimen.force, [F for _, F in CURVE])
    assert len(specimen.lines) == 30
    again = [f"{header}\n" + lines_of(CURVE, form)] * 2
    assert len(read(tmp_path, "\n".join(again))) == 2
    if time:  # which begins anew in a segment whose curve goes on
        anew = parts[1].replace(",1.0,1.0", ",1.0,0.0")
        assert refusal(read, tmp_path, f"{parts[0]}\n{anew}").field.endswith("column 'Time (s)'")


def test_line_of_text_and_a_cut_last_line_are_left_out_and_named(tmp_path):
    lines = PLAIN_CURVE.splitlines()
    text = "\n".join([*lines[:15], "gauge not found", *lines[15:], "81.2"])
    (specimen,) = read(tmp_path, text)
    np.testing.assert_allclose(specimen.force, [F for _, F in CURVE])
    assert "line 16, 'gauge not found', line 33, '81.2'" in specimen.summary
    for cut in ("1,x", "82.1,"):  # is no number, nor the last line
        table = "\n".join([*lines[:15], cut, *lines[15:]])
        assert "line 16" in refusal(read, tmp_path, table).field


def test_clock_of_the_day_that_begins_anew_goes_on_and_is_said(tmp_path):
    times = [(86399.5 + 0.04 * row) % 86400.0 for row in range(30)]
    cells = [f"{t // 3600:02.0f}:{t % 3600 // 60:02.0f}:{t % 60:06.3f}" for t in times]
    rows = "".join(f"{F},{x},{cell}\n" for (x, F), cell in zip(CURVE, cells, strict=True))
    (specimen,) = read(tmp_path, f"Force (N),Travel (mm),Time\n{rows}")
    np.testing.assert_allclose(np.diff(specimen.time), 0.04, atol=1e-6)
    assert len(specimen.notes) == 1


def test_time_that_runs_back_is_refused_with_the_time_before(tmp_path):
    rows = [f"{F},{x},{row}" for row, (x, F) in enumerate(CURVE)]
    rows[20] = rows[20].replace(",20", ",5")
    told = refusal(read, tmp_path, "Force (N),Travel (mm),Time (s)\n" + "\n".join(rows))
    assert (told.field[-26:], told.value) == ("line 22, column 'Time (s)'", 5.0)
    assert "19 s" in told.bound
    assert "sort" not in str(told).lower()


def test_unit_of_flag_and_file_may_not_differ(tmp_path):
    assert refusal(read, tmp_path, f"force_N,travel_mm\n{PLAIN}", units="force=kN").value == "N"
