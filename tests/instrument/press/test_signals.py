"""Signals: what is written is read line by line; everything else is an error that says where and what."""

import itertools

import pytest
from refusal import refusal

from instrument.press.signals import Signal
from pipeline.tables.headers import ColumnFlags
from pipeline.tables.rows import Rows, WholeRows

HEAD = "t_s,F_l_N,F_h_N\n"


def signal_of(text, tips=2):
    return Signal(Rows(text.splitlines(), "press.csv"), tips)


def samples_of(rows, tips):
    return list(Signal(rows, tips))


def test_samples_have_time_travel_and_forces():
    first, second = signal_of("t_s,x_mm,F_l_N,F_h_N\n0,0.1,0.2,0.3\n\n0.001,0.2,0.4,0.6\n")
    assert (first.t, first.forces) == (0.0, (0.2, 0.3))
    assert (second.line, second.t) == (4, 0.001)


@pytest.mark.parametrize(
    "text",
    [
        HEAD + "0,0.25,1.5\n",
        "F_h_N,t_s,F_l_N\n1.5,0,0.25\n",
        "t_ms,F_l_mN,F_h_mN\n0,250,1500\n",
        "t_s;F_l_N;F_h_N\n0;0,25;1,5\n",
        "t_s\tF_l_N\tF_h_N\n0\t0.25\t1.5",
    ],
)
def test_columns_are_taken_by_name_and_unit(text):
    (sample,) = signal_of(text)
    assert sample.forces == pytest.approx((0.25, 1.5))


def test_unit_that_is_not_given_is_noted():
    assert len(signal_of("t,F_l,F_h_N\n0,1,2\n").notes) == 2
    assert signal_of(HEAD).notes == ()
    assert signal_of("t_s,counts_l,counts_h\n0,81238,20138\n").notes == ()  # counts have none


def test_stream_is_read_line_by_line():
    """No more of a stream is taken than the lines that were asked for."""
    lines = itertools.chain([HEAD], (f"{number},0.2,0.5\n" for number in itertools.count()))
    samples = iter(Signal(Rows(lines, "-"), 2))
    assert [next(samples).t for _ in range(10)] == list(range(10))
    assert next(lines) == "10,0.2,0.5\n"


PRESS = [HEAD, *(f"{0.04 * row:.3f},{0.01 * row:.4f},{0.02 * row:.4f}\n" for row in range(60))]


@pytest.mark.parametrize(
    ("lines", "left_out"),
    [
        (PRESS, []),
        ([*PRESS[:20], "HX711 not found.\n", *PRESS[20:]], [21]),
        ([*PRESS[:20], "\n", "ERR,ERR,ERR\n", HEAD, *PRESS[20:]], [22, 23]),
        ([*PRESS, "2.400,0.60"], [62]),
        ([*PRESS, "2.400,0.6000,1.2"], [62]),
    ],
)
def test_lines_without_numbers_are_left_out_and_named_in_a_file_and_in_a_stream(lines, left_out):
    for rows in (Rows(lines, "-"), WholeRows(lines, "press.csv")):
        said = []
        samples = list(Signal(rows, 2, say=said.append))
        assert [sample.forces for sample in samples] == [
            pytest.approx((0.01 * row, 0.02 * row)) for row in range(len(samples))
        ]
        assert len(samples) == 60
        assert [int(text.split("line ")[1].split(",")[0]) for text in said] == left_out


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("2.400,0.6000\n", "line 62"),  # a cut line has no end
        ("2.400,0.6000,1.2000,1\n", "line 62"),
        ("t_s,F_l_mN,F_h_mN\n", "line 62"),
        ("kN,kN,kN\n", "line 62"),
        ("Units,kN\n", "line 62"),
        ("2,4OO,0,6\n", "line 62"),
    ],
)
def test_line_that_is_no_sample_is_refused_by_its_name(line, place):
    for rows in (Rows([*PRESS, line], "press.csv"), WholeRows([*PRESS, line], "press.csv")):
        assert place in refusal(samples_of, rows, 2).field


@pytest.mark.parametrize(
    ("label", "first", "period", "step"),
    [("t_ms", 2**32 - 500, 2**32, 40), ("t_us", 2**32 - 500, 2**32, 40), ("t_s", 4294967.0, 2**32 * 1e-3, 0.04)],
)
def test_clock_of_a_board_that_begins_anew_goes_on(label, first, period, step):
    said = []
    lines = [f"{label},F_l_N,F_h_N\n", *(f"{(first + step * row) % period:.10g},1,2\n" for row in range(60))]
    times = [sample.t for sample in Signal(Rows(lines, "-"), 2, say=said.append)]
    worth = {"t_ms": 1e-3, "t_us": 1e-6, "t_s": 1.0}[label]
    assert [after - before for before, after in itertools.pairwise(times)] == pytest.approx(
        [step * worth] * 59, abs=2e-3 * (label == "t_s") + 1e-9
    )
    assert len(said) == 1
    for late, place in ((20, "line 31"), (5, "line 3")):  # a line that comes late, of this round or of the one before
        told = refusal(list, Signal(Rows([*lines[:30], lines[late], *lines[30:]], "-"), 2))
        assert place in told.field
        assert "sort" not in str(told).lower()


def test_channels_are_named_by_a_flag():
    rows = Rows(["t_s,Force_l,reading_h [N]\n", "0,0.25,1.5\n"], "-")
    (sample,) = Signal(rows, 2, ColumnFlags("F_l=Force_l,F_h=reading_h [N]"))
    assert sample.forces == (0.25, 1.5)
    for label in ("A (V)", "A_mV", "A (counts)"):
        rows = Rows([f"t_s,{label},F_h_N\n", "0,1,2\n"], "-")
        assert label in refusal(Signal, rows, 2, ColumnFlags(f"F_l={label}")).field
