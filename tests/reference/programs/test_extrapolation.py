import pytest

from reference.extrapolation import RATE_BAND, richardson

ROUND_OFF = 1e-9


@pytest.mark.parametrize("rate", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("sizes", [(0.4, 0.2, 0.1), (0.5, 0.3, 0.2)])
def test_limit_of_an_exact_power_law_is_found_with_its_rate(rate, sizes):
    limit, C = 3.0, -0.7
    values = [limit + C * h**rate for h in sizes]
    found = richardson(values, sizes, rate)
    assert found.value == pytest.approx(limit, rel=ROUND_OFF)
    assert found.rate == pytest.approx(rate, rel=1e-6)  # the root finder stops at 1e-12, the differences amplify it
    assert 0.0 < found.error < abs(limit - values[-1])


@pytest.mark.parametrize("actual", [0.2, 0.3, 2.5, 4.0])
def test_rate_outside_the_band_gives_a_wide_bar_and_says_so(actual):
    assert not RATE_BAND[0] <= actual <= RATE_BAND[1]
    sizes = (0.4, 0.2, 0.1)
    values = [3.0 - 0.7 * h**actual for h in sizes]
    found = richardson(values, sizes, 1.0)
    assert found.rate == pytest.approx(actual, rel=1e-6)
    assert found.error >= 3.0 * abs(values[2] - values[1])
    assert abs(found.value - 3.0) <= found.error * (1.0 + ROUND_OFF)


@pytest.mark.parametrize(("values", "error"), [((1.0, 1.1, 1.3), 0.6), ((1.0, 1.2, 1.1), 0.6), ((1.5, 1.5, 1.5), 0.0)])
def test_values_that_run_away_or_turn_back_have_a_wide_bar_and_equal_ones_none(values, error):
    found = richardson(values, (0.4, 0.2, 0.1), 2.0)
    assert found.rate is None
    assert found.error == pytest.approx(error, abs=1e-11)
    assert found.value == values[2] or values[2] == 1.3
