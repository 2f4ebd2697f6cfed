"""The height on which a dome with a cap stands is the mean over a flat punch."""

import numpy as np
import pytest

from sensor.theory.dome_form import effective_cap_height


@pytest.mark.parametrize("contact", [0.0, 0.5, 1.5, 2.0, 2.5, 6.0])
def test_felt_height_is_the_mean_over_a_flat_punch(contact):
    """The area of the punch's pressure within r is 1 - u with u = sqrt(1 - (r / a)^2), so u is even."""
    u = (np.arange(200_000) + 0.5) / 200_000
    r = contact * np.sqrt(1.0 - u**2)
    cap = np.where(r < 2.0, (1.0 - (r / 2.0) ** 2) ** 2, 0.0)
    assert effective_cap_height(2.0, np.array(contact)) == pytest.approx(cap.mean(), abs=1e-9)
