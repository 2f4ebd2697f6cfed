"""Signals: what is written is read, in any named unit; everything else is one line that says where and what."""

import io

import pytest

from cad.quantity import InputError
from pipeline.measure.unit.signals import Signal, forces_of_text

PAIR, SQUARE = 2, 4
HEAD = b"t_s,F_l_N,F_h_N\n"


def signal_of(content, tips=PAIR):
    return Signal(io.BytesIO(content), "press.csv", tips)


def forces_in(content, tips=PAIR):
    return [sample.forces for sample in signal_of(content, tips)]


def test_samples_have_time_travel_and_forces():
    (first, second) = signal_of(b"t_s,x_mm,F_l_N,F_h_N\n0,0.1,0.2,0.3\n\n0.001,0.2,0.4,0.6\n")
    assert (first.t, first.x, first.forces) == (0.0, 0.1, (0.2, 0.3))
    assert (second.line, second.t, second.x) == (4, 0.001, 0.2)


@pytest.mark.parametrize(
    "content",
    [
        HEAD + b"0,0.25,1.5\n",
        b"\xef\xbb\xbf" + HEAD + b"0,0.25,1.5\r\n",
        b"F_h_N,t_s,F_l_N\n1.5,0,0.25\n",
        b"t_ms,F_l_mN,F_h_mN\n0,250,1500\n",
        b"t_s;F_l_N;F_h_N\n0;0,25;1,5\n",
        b"t_s\tF_l_N\tF_h_N\n0\t0.25\t1.5",
    ],
    ids=["plain", "marked", "order", "units", "decimal commas", "tabs"],
)
def test_columns_are_taken_by_name_and_unit(content):
    assert forces_in(content) == [pytest.approx((0.25, 1.5))]


def test_four_tips_have_numbers():
    assert forces_in(b"t_s,F_1_N,F_2_N,F_3_N,F_4_N\n0,1,2,3,4\n", SQUARE) == [(1.0, 2.0, 3.0, 4.0)]


def test_unit_that_is_not_given_is_told():
    assert signal_of(b"t,F_l,F_h_N\n0,1,2\n").columns.assumed == (
        "press.csv: column 't' gives no unit, taken as s",
        "press.csv: column 'F_l' gives no unit, taken as N",
    )
    assert signal_of(HEAD).columns.assumed == ()


BAD = [
    (b"", "press.csv: empty; must be a header like t_s,F_l_N,F_h_N"),
    (HEAD, "press.csv: no samples; must have lines of numbers"),
    (b"0,1,2\n0,1,2\n", "line 1 column '0': must be a header like t_s,F_l_N,F_h_N"),
    (b"t_s,F_l_lbf,F_h_N\n", "line 1 column 'F_l_lbf': unit lbf must be one of N, mN"),
    (b"t_s,F_1_N,F_2_N,F_3_N,F_4_N\n", "forces F_1, F_2, F_3, F_4: must be F_l, F_h, one for each tip of this sensor"),
    (b"t_s,F_l_N\n", "forces F_l: must be F_l, F_h"),
    (b"F_l_N,F_h_N\n", "no column t_s"),
    (b"t_s,F_l_N,F_l_mN,F_h_N\n", "column 'F_l_N': must stand once"),
    (HEAD + b"0,0,25,0,5\n", "line 2: 5 values; must be 3, as its header; write decimals with a point"),
    (HEAD + b"0,1\n", "line 2: 2 values; must be 3"),
    (HEAD + b"0,1,2\n1,one,2\n", "line 3 column 'F_l_N' = 'one': must be a number; mend that line"),
    (HEAD + b"0,1,nan\n", "line 2 column 'F_h_N' = nan: must be a finite number"),
    (HEAD + b"0,inf,1\n", "line 2 column 'F_l_N' = inf: must be a finite number"),
    (HEAD + b"1,1,2\n0.5,1,2\n", "line 3 column 't_s' = 0.5 s: must be at least the 1 s of the line before"),
    (b"\x00\x01\x02\n", "line 1: must be text in UTF-8"),
    (HEAD + b"\xff\xfe\n", "line 2: must be text in UTF-8"),
    (HEAD + b"1" * 5000, "line 2: must be text in UTF-8"),
]


@pytest.mark.parametrize(("content", "message"), BAD, ids=[message for _, message in BAD])
def test_bad_signal_is_one_line_that_says_where(content, message):
    with pytest.raises(InputError) as caught:
        forces_in(content)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_stream_is_read_line_by_line():
    """No more of a stream is taken than the lines that were asked for."""

    class Endless(io.RawIOBase):
        lines = 0

        def readline(self, size=-1):
            assert size > 0
            self.lines += 1
            return HEAD if self.lines == 1 else b"%d,0.2,0.5\n" % self.lines

    endless = Endless()
    samples = iter(Signal(endless, "-", PAIR))
    for _ in range(10):
        next(samples)
    assert endless.lines == 11


def test_forces_of_a_flag():
    assert list(forces_of_text("0.2,1.5", PAIR)) == [0.2, 1.5]
    with pytest.raises(InputError, match="3 forces; must be 2 in N, one for each tip"):
        forces_of_text("1,2,3", PAIR)
    with pytest.raises(InputError, match="must be 2 numbers in N"):
        forces_of_text("1,two", PAIR)
