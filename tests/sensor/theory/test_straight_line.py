"""The straight line that calibration fits: each number against least squares by another method, or a formula."""

import numpy as np
import pytest
from scipy.stats import t as student_t

from sensor.quantity import COVERAGE
from sensor.theory.straight_line import fit_line

ROUNDED = 1.0 / np.sqrt(12.0)
FINE, COARSE = 1e-6, 1e-3


def drawn(rng, count):
    """Return points of a noisy line, some of them at the same x."""
    x = np.round(rng.uniform(0.0, 4.0, count), int(rng.integers(0, 5)))
    x[:2] = (0.0, 4.0)
    shown = rng.normal() + (x + rng.choice([0.0, 0.1]) * x**2) * 10.0 ** rng.integers(-3, 6)
    return x, shown + 0.01 * np.ptp(shown) * rng.normal(size=count)


def without_each(x, shown, digit):
    """Yield the index of each row with the squares of the line of the others, its expectation, and what is likely."""
    for row in range(len(x)):
        others = np.delete(x, row)
        if np.ptp(others) < 0.1 * np.ptp(x):
            continue
        line = np.polyfit(others, np.delete(shown, row), 1)
        squares = float(np.sum((np.delete(shown, row) - np.polyval(line, others)) ** 2))
        freedom = len(others) - 2
        apart = (x[row] - others.mean()) / np.linalg.norm(others - others.mean())
        deviation = np.hypot(np.sqrt(squares / freedom), ROUNDED * digit) * np.sqrt(1.0 + 1.0 / len(others) + apart**2)
        yield squares, row, np.polyval(line, x[row]), student_t.ppf(1.0 - 0.5e-4 / len(x), freedom) * deviation


def test_line_and_its_suspect_are_those_of_least_squares_without_each_row(rng):
    for _ in range(100):
        x, shown = drawn(rng, int(rng.integers(5, 15)))
        line = fit_line(x, shown, np.full(len(x), COARSE))
        slope, zero = np.polyfit(x, shown, 1)
        span = np.ptp(shown)
        assert line.slope.value == pytest.approx(slope, rel=1e-9)
        assert line.zero == pytest.approx(zero, abs=1e-9 * span)
        _, index, expected, likely = min(without_each(x, shown, COARSE))
        assert line.suspect.index == index
        assert line.suspect.expected == pytest.approx(expected, abs=1e-9 * span)
        assert line.suspect.residual == pytest.approx(abs(shown[index] - expected), rel=1e-6, abs=1e-9 * span)
        assert line.suspect.likely == pytest.approx(likely, rel=1e-6)


@pytest.mark.parametrize(("spike", "found"), [(0.0099, False), (0.0101, True)])
def test_a_residual_counts_from_a_hundredth_of_the_span(spike, found):
    x = np.arange(9.0)
    shown = x + spike * 8.0 * np.eye(9)[4]
    assert (fit_line(x, shown, np.full(9, FINE)).outlier(8.0) is not None) is found
    assert fit_line(x, shown, np.full(9, FINE)).outlier(80.0) is None


@pytest.mark.parametrize(
    ("x", "shown", "rows"),
    [
        ([0.0, 1.0, 1.0, 1.0, 1.0], [0.0, 2.0, 2.0, 2.0, 2.5], {4}),
        ([0.0, 1.0, 1.0, 1.0, 1.0], [4711.0] * 5, {1, 2, 3, 4}),
        ([0.0, 1.0, 1.05, 1.0, 1.05], [5.0, 2.0, 2.1, 2.0, 2.1], {1, 2, 3, 4}),
        ([0.0, 1.0, 1.0], [0.0, 1.0, 1.2], set()),
        ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], set()),
    ],
)
def test_a_row_without_which_the_others_draw_no_line_is_no_suspect(x, shown, rows):
    suspect = fit_line(np.array(x), np.array(shown), np.full(len(x), FINE)).suspect
    assert suspect.index in rows if rows else suspect is None


@pytest.mark.parametrize(
    ("rows", "digits"), [(3, [1e-3]), (3, [1e-3, 1e-4, 1e-3]), (4, [1e-9]), (17, [1e-9]), (18, [1e-9]), (60, [1e-9])]
)
def test_a_bar_is_wider_for_few_rows_by_student_s_t(rows, digits):
    """Residuals that a straight line leaves as they are: alike at both ends, and without a sum.

    The rounding of the finest number adds to them.
    """
    x = np.linspace(-1.0, 1.0, rows)
    left = 0.01 * np.where(np.abs(x) == 1.0, 1.0, -2.0 / (rows - 2))
    scatter = student_t.ppf(0.975, rows - 2) / COVERAGE * np.linalg.norm(left) / np.sqrt(rows - 2)
    expected = np.hypot(scatter, ROUNDED * min(digits)) / np.linalg.norm(x)
    error = fit_line(x, x + left, np.resize(digits, rows), levels=np.zeros(rows)).slope.error
    assert error == pytest.approx(expected, rel=1e-9)


def test_a_bent_line_has_the_bar_of_its_parabola_and_of_its_bend(rng):
    """The scatter about the parabola, and half of what the bend leaves open, which is the error at either end."""
    x = np.linspace(0.0, 4.0, 9)
    digits = np.where(x == 0.0, FINE, COARSE)
    shown = x + 0.05 * x**2 + 1e-3 * rng.normal(size=9)
    parabola, covariance = np.polyfit(x, shown, 2, cov="unscaled")
    scatter = np.sqrt(np.sum((shown - np.polyval(parabola, x)) ** 2) / 6.0)
    slope = np.polyfit(x, shown, 1)[0]
    wider = student_t.ppf(0.975, 6) / 2.0
    deviation = 2.0 * 4.0 * wider * np.sqrt((scatter**2 + (ROUNDED * COARSE) ** 2) * covariance[0, 0]) / slope
    line = fit_line(x, shown, digits)
    assert line.bend.change == pytest.approx(2.0 * 4.0 * parabola[0] / slope, rel=1e-9)
    assert line.bend.change_deviation == pytest.approx(deviation, rel=1e-9)
    assert line.bend.unexplained_change == pytest.approx(line.bend.change - 3.0 * deviation, rel=1e-9)
    about = np.hypot(wider * scatter, ROUNDED * FINE) / np.linalg.norm(x - 2.0)
    assert line.slope.error == pytest.approx(np.hypot(about, 0.5 * deviation * slope), rel=1e-9)


def test_a_bend_needs_three_levels_of_x():
    """Two weights that are read at several times have more than two abscissas, and no bend."""
    forces = np.array([0.0, 0.0, 0.9, 1.0, 1.1, 1.2])
    loads = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0])
    shown = forces + 0.2 * forces**2
    digits = np.full(6, FINE)
    assert fit_line(forces, shown, digits).bend.unexplained_change > 0.1
    assert fit_line(forces, shown, digits, levels=loads).bend.change == 0.0


def test_a_level_line_has_a_slope_of_0_and_no_bend():
    line = fit_line(np.arange(6.0), np.full(6, 4711.0), np.ones(6))
    assert (line.slope.value, line.zero, line.bend.change, line.outlier()) == (0.0, 4711.0, 0.0, None)
