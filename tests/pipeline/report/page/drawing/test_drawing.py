"""Scales and panels of plots show values where they are."""

import math
import re

import numpy as np
import pytest

from pipeline.report.page.drawing.labels import apart, write_beside
from pipeline.report.page.drawing.panel import Box, Panel, Words
from pipeline.report.page.drawing.scale import Scale

MINUS = "\N{MINUS SIGN}"
BOX = Box(left=10.0, top=20.0, width=100.0, height=50.0)


def panel(**changes):
    return Panel(name="p", box=BOX, **({"x": Scale(start=0, end=2), "y": Scale(start=0, end=1)} | changes))


@pytest.mark.parametrize(
    ("scale", "texts"),
    [
        (Scale(start=0.0, end=0.73), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7"]),
        (Scale(start=-100.0, end=100.0), [f"{MINUS}100", f"{MINUS}50", "0", "50", "100"]),
        (Scale(start=0.0, end=5.6, steps=3), ["0", "2", "4"]),
        (Scale(start=0.006, end=50.0, logarithmic=True), ["0.01", "0.1", "1", "10"]),
        (Scale(start=0.3, end=4.0, logarithmic=True), ["0.5", "1", "2"]),
        (Scale(start=2.1, end=4.9, logarithmic=True), ["2.5", "3.0", "3.5", "4.0", "4.5"]),
        (Scale(start=3e-6, end=2e4, logarithmic=True), ["0.0001", "0.01", "1", "100", "10000"]),
        (Scale(start=1e-7, end=6e-7, logarithmic=True), ["10⁻⁷", "2×10⁻⁷", "5×10⁻⁷"]),
    ],
)
def test_numbers_of_a_scale_are_round_and_inside(scale, texts):
    assert [text for _, text in scale.ticks] == texts
    assert all(scale.start <= value <= scale.end for value, _ in scale.ticks)


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize("power", range(-9, 10))
def test_numbers_are_short_and_no_more_than_the_steps_at_any_size(power, logarithmic):
    """Ends of three first digits; a logarithmic scale begins at the smallest of all."""
    for digit in (1.0, 2.04, 9.99):
        scale = Scale(start=9e-10 if logarithmic else 0.0, end=digit * 10.0**power, logarithmic=logarithmic)
        texts = [text for _, text in scale.ticks]
        assert max(map(len, texts)) <= 6
        assert 2 <= len(texts) <= scale.steps + 1


@pytest.mark.parametrize(
    ("end", "text", "named"),
    [
        (0.005, "5", ["pressure [10⁻³ MPa]", "P [10⁻³]"]),
        (2e-7, "200", ["pressure [10⁻⁹ MPa]", "P [10⁻⁹]"]),
        (0.1, "0.10", ["pressure [MPa]", "P [1]"]),
        (2e6, "2.0", ["pressure [10⁶ MPa]", "P [10⁶]"]),
    ],
)
def test_name_of_a_scale_states_the_power_of_ten_of_its_numbers(end, text, named):
    scale = Scale(start=0.0, end=end)
    value, last = scale.ticks[-1]
    assert (value, last) == (pytest.approx(end), text)
    assert [scale.named(label) for label in ("pressure [MPa]", "P [1]")] == named
    assert f">{named[1]}</text>" in panel(x=scale, x_label="P [1]").svg()


def test_values_stand_in_proportion_or_by_their_logarithm():
    assert Scale(start=-1.0, end=3.0).shares([-1.0, 1.0, 3.0]).tolist() == [0.0, 0.5, 1.0]
    assert Scale(start=0.1, end=1000.0, logarithmic=True).shares([0.1, 10.0, 1000.0]) == pytest.approx([0.0, 0.5, 1.0])


@pytest.mark.parametrize(
    "ends",
    [
        {"start": 1.0, "end": 1.0},
        {"start": 0.0, "end": math.nan},
        {"start": 0.0, "end": math.inf},
        {"start": -math.inf, "end": 0.0},
        {"start": 0.0, "end": 1.0, "logarithmic": True},
    ],
)
def test_scale_without_extent_is_refused(ends):
    with pytest.raises(ValueError, match="scale"):
        Scale(**ends)


def test_line_runs_through_its_values_and_breaks_where_one_is_missing():
    drawn = panel()
    drawn.line([0.0, 1.0, np.nan, 1.5, 2.0], [0.0, 0.5, 0.5, 1.0, 1.0], "red")
    assert 'd="M10.00 70.00L60.00 45.00M85.00 20.00L110.00 20.00"' in drawn.svg()


def test_words_are_text_that_cannot_be_markup():
    drawn = panel(x_label="<x>")
    drawn.write("<b>", 1.0, 0.5, Words())
    assert re.findall(r">(&lt;[xb]&gt;)</text>", drawn.svg()) == ["&lt;x&gt;", "&lt;b&gt;"]


def test_labels_keep_apart_and_move_as_little_as_may_be():
    """R. E. Barlow et al., Statistical Inference under Order Restrictions, 1972, max-min formula; ends push them in."""
    places, step = np.array([1.0, 1.0, 1.2, 5.0, 5.1, 9.0]), 0.8
    steps, count = step * np.arange(len(places)), len(places)
    free = places - steps
    nearest = steps + [
        max(min(free[i:j].mean() for j in range(at + 1, count + 1)) for i in range(at + 1)) for at in range(count)
    ]
    assert apart(places, step, -100.0, 100.0) == pytest.approx(nearest)
    pushed = apart(places, step, 0.9, 8.5)
    assert np.diff(pushed).min() >= step * (1.0 - 1e-12)
    assert (pushed[0], pushed[-1]) == pytest.approx((0.9, 8.5))


def test_labels_without_room_leave_out_inner_ones():
    """Four rows of 11 pt in a panel of 50 pt; the first and the last of ten labels are written."""
    drawn = panel()
    write_beside(drawn, 1.0, np.full(10, 0.5), [(f"label {place}", Words()) for place in range(10)])
    assert re.findall(r">label (\d)<", "".join(drawn.written)) == ["0", "3", "6", "9"]
    levels = [float(text) for text in re.findall(r' y="([\d.]+)"', "".join(drawn.written))]
    assert np.diff(levels) == pytest.approx(-11.0)
    assert max(levels) < BOX.top + BOX.height
