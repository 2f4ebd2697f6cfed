"""The heights that a dome feels on an uneven skin, against the integrals that they are."""

import numpy as np
import pytest
from scipy.integrate import dblquad, quad
from scipy.special import j0

from sensor.theory.uneven_skin import correlations, effective_heights, wave_numbers


@pytest.mark.parametrize("wave_mm", [2.0, 4.0, 8.0])
@pytest.mark.parametrize("radius", [0.0, 0.3, 1.0, 1.8])
def test_felt_height_is_the_mean_under_a_flat_punch(wave_mm, radius):
    """With r = a sin(s) the weight 1 / (2 pi a sqrt(a^2 - r^2)) dA is sin(s) ds dphi / (2 pi), without a pole."""
    k = 2.0 * np.pi / wave_mm

    def weighted(s, phi):
        return np.cos(k * radius * np.sin(s) * np.cos(phi)) * np.sin(s) / (2.0 * np.pi)

    mean, _ = dblquad(weighted, 0.0, 2.0 * np.pi, 0.0, 0.5 * np.pi)
    assert effective_heights(k, np.array(radius)) == pytest.approx(mean, abs=1e-7)


def test_correlation_is_the_mean_over_all_directions():
    mean, _ = quad(lambda phi: np.cos(1.3 * 6.0 * np.cos(phi)) / (2.0 * np.pi), 0.0, 2.0 * np.pi)
    assert correlations(1.3, np.array([0.0, 6.0])) == pytest.approx([1.0, mean])


@pytest.mark.parametrize(("shortest", "longest"), [(2.0, 8.0), (0.5, 20.0), (4.0, 4.0)])
def test_waves_have_even_shares_over_the_logarithm_of_their_length(shortest, longest):
    """The mean of the logarithm is that of the ends; the mean of a felt height is that of the integral."""
    k, shares = wave_numbers(shortest, longest)
    assert shares.sum() == pytest.approx(1.0)
    assert shares @ np.log(2.0 * np.pi / k) == pytest.approx(0.5 * np.log(shortest * longest))
    ends = np.log([shortest, longest])
    spread = max(ends[1] - ends[0], 1e-9)
    integral, _ = quad(lambda at: float(j0(2.0 * np.pi / np.exp(at))) / spread, ends[0], ends[0] + spread)
    assert shares @ j0(k) == pytest.approx(integral, abs=2e-3)
