"""A line over the press of a pair: exact under any misalignment, refused where it tells nothing."""

import numpy as np
import pytest

from cad.theory.contrast_law import ReadingError
from cad.theory.pair_line import PressSums, line_of_sums, line_over_press, ratio_modulus
from cad.theory.two_spring_law import PAPER_SPRINGS, fruit_stiffness

ROUND_OFF = 1e-9
C = np.diag([1.0 / 0.753, 1.0 / 17.3])  # of the paper's springs [mm/N]
S = np.array([[0.8, 0.04], [0.04, 0.8]])
S_DIFFERENCE = 0.76


def press(E, travels, lead=0.0, C=C):
    """Return the forces of both tips [N] over a press; the low tip travels by `lead` [mm] more."""
    return np.array([np.linalg.solve(C + S / E, [travel + lead, travel]) for travel in travels])


def summed(forces):
    sums = PressSums()
    for low, high in forces.tolist():
        sums = sums.joined(PressSums(1, low, high))
    return sums


def test_slope_is_the_modulus_and_the_intercept_the_misalignment():
    rng = np.random.default_rng(3)
    for _ in range(200):
        coupled = np.diag(1.0 / rng.uniform((0.5, 10.0), (2.0, 30.0))) + rng.uniform(0.0, 1e-3)
        E = 10.0 ** rng.uniform(-0.5, 0.7)
        lead = rng.uniform(-0.05, 0.05)
        forces = press(E, np.linspace(0.2, 0.6, 9), lead, coupled)
        found = line_over_press(coupled.tolist(), S_DIFFERENCE, forces.tolist())
        assert found.modulus == pytest.approx(E, rel=ROUND_OFF)
        assert found.lead == pytest.approx(lead, rel=ROUND_OFF, abs=1e-12)


def test_samples_in_which_a_tip_is_off_do_not_count():
    samples = [[0.1, 0.0], [0.2, -0.1], *press(2.0, np.linspace(0.2, 0.6, 3)).tolist()]
    assert line_over_press(C.tolist(), S_DIFFERENCE, samples).modulus == pytest.approx(2.0, rel=ROUND_OFF)
    with pytest.raises(ReadingError):
        line_over_press(C.tolist(), S_DIFFERENCE, samples[:4])


def test_forces_of_another_sensor_are_refused():
    exchanged = C[::-1, ::-1].tolist()
    with pytest.raises(ReadingError):
        line_over_press(exchanged, S_DIFFERENCE, [[0.1, 0.2], [0.2, 0.4], [0.3, 0.6]])


def test_noise_on_both_forces_does_not_bias_the_line():
    """An ordinary fit of y over x would, by the share of noise in the spread of x; the error bar holds the rest."""
    rng = np.random.default_rng(5)
    E, noise, count = 0.5, 0.02, 300
    exact = press(E, np.linspace(0.1, 0.6, 200))
    read, ordinary, errors = np.empty((3, count))
    for index in range(count):
        sums = summed(exact + noise * rng.normal(size=exact.shape))
        found = line_of_sums(C.tolist(), S_DIFFERENCE, sums, (noise, noise))
        read[index] = found.modulus / E - 1.0
        errors[index] = found.error
        ordinary[index] = line_of_sums(C.tolist(), S_DIFFERENCE, sums).modulus / E - 1.0
    assert abs(np.median(read)) < 3.0 * np.std(read) / np.sqrt(count)
    assert np.mean(np.abs(read) <= 2.0 * errors) > 0.92
    assert abs(np.median(ordinary)) > 0.1


def test_sums_in_any_grouping_are_those_of_all_samples():
    forces = np.random.default_rng(6).uniform(0.1, 1.0, (60, 2))
    halves = summed(forces[:20]).joined(summed(forces[20:]))
    for whole in (summed(forces), halves):
        left = forces - forces.mean(axis=0)
        assert (whole.soft, whole.stiff) == pytest.approx(tuple(forces.mean(axis=0)), rel=ROUND_OFF)
        products = (whole.soft_soft, whole.soft_stiff, whole.stiff_stiff)
        assert products == pytest.approx(tuple((left.T @ left)[np.triu_indices(2)]), rel=ROUND_OFF)
    assert PressSums().joined(PressSums()) == PressSums()


def test_force_ratio_is_4_of_the_paper_and_a_lead_moves_it():
    E = 2.0
    low, high = press(E, [0.6])[0]
    K_m = fruit_stiffness(PAPER_SPRINGS, high / low)
    assert ratio_modulus(C.tolist(), S_DIFFERENCE, (low, high)) == pytest.approx(S_DIFFERENCE * K_m, rel=ROUND_OFF)
    tilted = np.linalg.solve(C + S / E, [0.53, 0.67])  # 1 degree over 8 mm
    assert ratio_modulus(C.tolist(), S_DIFFERENCE, tilted) > 1.3 * E
    with pytest.raises(ReadingError):
        ratio_modulus(C.tolist(), S_DIFFERENCE, (high, low))
