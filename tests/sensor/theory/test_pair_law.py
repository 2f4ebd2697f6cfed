"""The contrast of a pair: exact under any misalignment, refused where it tells nothing."""

import numpy as np
import pytest

from sensor.theory.contrast_law import ReadingError, pair_law, ratio_modulus, read_modulus
from sensor.theory.contrast_rise import FEWEST, RiseError, RiseLaw, read_rise, rise_of
from sensor.theory.two_spring_law import PAPER_SPRINGS, fruit_stiffness

ROUND_OFF = 1e-9
C = np.diag([1.0 / 0.753, 1.0 / 17.3])  # of the paper's springs [mm/N]
S = np.array([[0.8, 0.04], [0.04, 0.8]])
S_DIFFERENCE = 0.76


def press(E, travels, lead=0.0, C=C):
    """Return the forces of both tips [N] over a press; the low tip travels by `lead` [mm] more."""
    return np.array([np.linalg.solve(C + S / E, [travel + lead, travel]) for travel in travels])


def read(forces, noises=(0.0, 0.0), C=C):
    law = RiseLaw(contrast=pair_law(C.tolist(), S_DIFFERENCE))
    return read_rise(law, rise_of(forces, 2), np.array(noises))


def least_deviation(E, travels, noises):
    """Return the Cramer-Rao bound of ln E [1]: r = (C F)_h - (C F)_l + s (F_h - F_l) z^3 + gamma, by hand."""
    x = np.diff(press(E, travels), axis=1)[:, 0]
    by_force = np.array([C[0, 0] + S_DIFFERENCE / E, C[1, 1] + S_DIFFERENCE / E])
    s = np.linalg.norm(by_force * noises)
    return s / (S_DIFFERENCE / E * np.sqrt(len(x)) * x.std())


def test_rise_is_the_modulus_and_the_offset_the_misalignment():
    rng = np.random.default_rng(3)
    for _ in range(200):
        coupled = np.diag(1.0 / rng.uniform((0.5, 10.0), (2.0, 30.0))) + rng.uniform(0.0, 1e-3)
        E = 10.0 ** rng.uniform(-0.5, 0.7)
        lead = rng.uniform(-0.05, 0.05)
        forces = press(E, np.linspace(0.2, 0.6, 9), lead, coupled)
        found = read(forces, C=coupled)
        assert pytest.approx(E, rel=ROUND_OFF) == found.E
        assert found.offset == pytest.approx(lead, rel=ROUND_OFF, abs=1e-12)


def test_samples_in_which_a_tip_is_off_do_not_count():
    pressed = press(2.0, np.linspace(0.2, 0.6, FEWEST + 1)).tolist()
    found = read(np.array([[0.1, 0.0], [0.2, -0.1], *pressed]))
    assert pytest.approx(2.0, rel=ROUND_OFF) == found.E
    few = press(2.0, np.linspace(0.2, 0.6, FEWEST))  # the first one is an instrument alone
    with pytest.raises(RiseError) as refused:
        read(few)
    assert refused.value.flag == "few_samples"


def test_forces_of_another_sensor_are_refused():
    with pytest.raises(RiseError) as refused:
        read(press(2.0, np.linspace(0.1, 0.6, 30))[:, ::-1])
    assert refused.value.flag == "out_of_range"


@pytest.mark.parametrize("presses", [100, pytest.param(1000, marks=pytest.mark.study)])
@pytest.mark.parametrize("noise", [0.001, 0.005])
@pytest.mark.parametrize("E", [0.5, 3.5])
def test_noise_scatters_a_pair_as_told_near_the_bound_and_does_not_bias_it(E, noise, presses):
    """Noise over full scale. What is unbiased is the root of covariances, 1 / E; a line of y over x is not.

    The first of a hundred samples is an instrument alone, which costs 3 / 100 of the variance.
    """
    rng = np.random.default_rng(5)
    travels = np.linspace(0.1, 0.6, 100)
    exact = press(E, travels, 0.01)
    noises = noise * press(3.5, [0.6])[0]
    softness, told = np.empty((2, presses))
    for index in range(presses):
        found = read(exact + noises * rng.normal(size=exact.shape), noises)
        softness[index] = E / found.E - 1.0
        told[index] = found.noise
    deviation = softness.std()
    three_sigma = 3.0 / np.sqrt(presses)
    assert abs(softness.mean()) < three_sigma * deviation
    assert np.sqrt(np.mean(told**2)) == pytest.approx(deviation, rel=three_sigma / np.sqrt(2.0) + 0.01)
    above_bound = (deviation / least_deviation(E, travels, noises)) ** 2
    assert above_bound == pytest.approx(1.03, abs=three_sigma * np.sqrt(2.0) + 0.02)


def test_force_ratio_is_4_of_the_paper_and_a_lead_moves_it():
    E = 2.0
    low, high = press(E, [0.6])[0]
    K_m = fruit_stiffness(PAPER_SPRINGS, high / low)
    assert ratio_modulus(C.tolist(), S_DIFFERENCE, (low, high)) == pytest.approx(S_DIFFERENCE * K_m, rel=ROUND_OFF)
    assert read_modulus(pair_law(C.tolist(), S_DIFFERENCE), (low, high)) == pytest.approx(E, rel=ROUND_OFF)
    tilted = np.linalg.solve(C + S / E, [0.53, 0.67])  # 1 degree over 8 mm
    assert ratio_modulus(C.tolist(), S_DIFFERENCE, tilted) > 1.3 * E
    with pytest.raises(ReadingError):
        ratio_modulus(C.tolist(), S_DIFFERENCE, (high, low))
