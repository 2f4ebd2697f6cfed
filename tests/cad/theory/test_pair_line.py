"""A line over the press of a pair: exact under any misalignment, refused where it tells nothing."""

import numpy as np
import pytest

from cad.theory.contrast_law import ReadingError
from cad.theory.pair_line import PressSums, line_of_sums, line_over_press, ratio_modulus
from cad.theory.two_spring_law import Springs, fruit_stiffness

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
    with pytest.raises(ReadingError):
        line_over_press(C.tolist(), 0.76, samples[:4])


def test_forces_of_another_sensor_are_refused():
    C = [[0.05, 0.0], [0.0, 1.0]]
    with pytest.raises(ReadingError):
        line_over_press(C, 0.76, [[0.1, 0.2], [0.2, 0.4], [0.3, 0.6]])


def test_noise_on_both_forces_does_not_bias_the_line():
    """An ordinary fit of y over x would, by the share of noise in the spread of x; the error bar holds the rest."""
    rng = np.random.default_rng(5)
    C, S, E, noises = np.diag([1.0 / 0.753, 1.0 / 17.3]), np.array([[0.8, 0.04], [0.04, 0.8]]), 0.5, (0.02, 0.02)
    read, ordinary, errors = [], [], []
    for _ in range(300):
        forces = np.array([np.linalg.solve(C + S / E, [x, x]) for x in np.linspace(0.1, 0.6, 200)])
        forces += np.array(noises) * rng.normal(size=forces.shape)
        sums = PressSums()
        for soft, stiff in forces.tolist():
            sums = sums.joined(PressSums(1, soft, stiff))
        found = line_of_sums(C.tolist(), 0.76, sums, noises)
        read.append(found.modulus / E - 1.0)
        errors.append(found.error)
        ordinary.append(line_of_sums(C.tolist(), 0.76, sums).modulus / E - 1.0)
    assert abs(np.median(read)) < 3.0 * np.std(read) / np.sqrt(300)
    assert np.mean(np.abs(read) <= 2.0 * np.array(errors)) > 0.92
    assert abs(np.median(ordinary)) > 0.1


def test_sums_in_any_grouping_are_those_of_all_samples():
    rng = np.random.default_rng(6)
    forces = rng.uniform(0.1, 1.0, (60, 2))
    whole = PressSums()
    for soft, stiff in forces.tolist():
        whole = whole.joined(PressSums(1, soft, stiff))
    left = forces - forces.mean(axis=0)
    assert (whole.soft, whole.stiff) == pytest.approx(tuple(forces.mean(axis=0)), rel=ROUND_OFF)
    products = (whole.soft_soft, whole.soft_stiff, whole.stiff_stiff)
    assert products == pytest.approx(tuple((left.T @ left)[np.triu_indices(2)]), rel=ROUND_OFF)
    assert PressSums().joined(PressSums()) == PressSums()


def test_force_ratio_is_4_of_the_paper_and_a_lead_moves_it():
    C, S, E = np.diag([1.0 / 0.753, 1.0 / 17.3]), np.array([[0.8, 0.04], [0.04, 0.8]]), 2.0
    soft, stiff = np.linalg.solve(C + S / E, [0.6, 0.6])
    K_m = fruit_stiffness(Springs(K_l=0.753, K_h=17.3), stiff / soft)
    assert ratio_modulus(C.tolist(), 0.76, (soft, stiff)) == pytest.approx(0.76 * K_m, rel=ROUND_OFF)
    tilted = np.linalg.solve(C + S / E, [0.53, 0.67])  # 1 degree over 8 mm
    assert ratio_modulus(C.tolist(), 0.76, tilted) > 1.3 * E
    with pytest.raises(ReadingError):
        ratio_modulus(C.tolist(), 0.76, (stiff, soft))
