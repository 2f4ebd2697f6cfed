"""A line over the press of a pair: exact under any misalignment, refused where it tells nothing."""

import numpy as np
import pytest

from cad.theory.contrast_law import ReadingError
from cad.theory.pair_line import line_over_press

ROUND_OFF = 1e-9


def press(E, lead, C, S):
    """Return the forces of both tips [N] over a press; the low tip travels by `lead` [mm] more."""
    return np.array([np.linalg.solve(C + S / E, [x + lead, x]) for x in np.linspace(0.2, 0.6, 9)])


def test_slope_is_the_modulus_and_the_intercept_the_misalignment():
    rng = np.random.default_rng(3)
    for _ in range(200):
        C = np.diag(1.0 / rng.uniform((0.5, 10.0), (2.0, 30.0))) + rng.uniform(0.0, 1e-3)
        S = np.array([[0.8, 0.04], [0.04, 0.8]])
        E, lead = 10.0 ** rng.uniform(-0.5, 0.7), rng.uniform(-0.05, 0.05)
        found = line_over_press(C.tolist(), 0.76, press(E, lead, C, S).tolist())
        assert found.modulus == pytest.approx(E, rel=ROUND_OFF)
        assert found.lead == pytest.approx(lead, rel=ROUND_OFF, abs=1e-12)


def test_samples_in_which_a_tip_is_off_do_not_count():
    C, S = np.diag([1.0, 0.05]), np.array([[0.8, 0.04], [0.04, 0.8]])
    samples = [[0.1, 0.0], [0.2, -0.1], *press(2.0, 0.0, C, S).tolist()]
    assert line_over_press(C.tolist(), 0.76, samples).modulus == pytest.approx(2.0, rel=ROUND_OFF)
    with pytest.raises(ReadingError, match="samples with both tips on the fruit = 2: must be at least 3"):
        line_over_press(C.tolist(), 0.76, samples[:4])


def test_forces_of_another_sensor_are_refused():
    C = [[0.05, 0.0], [0.0, 1.0]]
    with pytest.raises(ReadingError, match="belong to no modulus"):
        line_over_press(C, 0.76, [[0.1, 0.2], [0.2, 0.4], [0.3, 0.6]])
