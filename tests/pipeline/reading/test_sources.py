"""The sources of a reading's uncertainty against many noisy readings."""

import numpy as np
import pytest
from square_stand_ins import square_contact, square_design, square_springs

from pipeline.reading.measurement import PRESS_TRAVELS, LineModel, measurement_model
from pipeline.reading.uncertainty import noise_to_reach, uncertainty_sources

E = 2.0
COUNT = 4000
STATISTICAL = 0.05  # 3.5 / sqrt(2 x 4000)
NO_POSES = {"tilt": 0.0}


def level_press(samples=1):
    travels = 0.6 * np.arange(1, samples + 1) / samples
    return np.array([np.linalg.solve(square_springs() + square_contact().S / E, np.full(4, x)) for x in travels])


def sources_of(model, press, **reading):
    full_scale = press.max(axis=0)
    return uncertainty_sources(model, square_design(**reading).reading, press, full_scale, NO_POSES)


@pytest.fixture
def model():
    return measurement_model(square_design(), square_contact(), square_springs())


def scattered(reads):
    rng = np.random.default_rng(5)
    return np.std([reads(rng) for _ in range(COUNT)]) / E


def test_noise_scatters_readings_as_told(model):
    press = level_press()
    found = sources_of(model, press, noise_percent=0.2, noise_N=0.002)
    full_scale = press.max(axis=0)
    by_percent = scattered(lambda rng: model.modulus(press + 0.002 * full_scale * rng.standard_normal(press.shape)))
    by_force = scattered(lambda rng: model.modulus(press + 0.002 * rng.standard_normal(press.shape)))
    assert found.contributions["noise_percent"] == pytest.approx(by_percent, rel=STATISTICAL)
    assert found.contributions["noise_N"] == pytest.approx(by_force, rel=STATISTICAL)


def test_unknown_springs_and_gains_scatter_readings_as_told(model):
    press = level_press()
    found = sources_of(model, press, stiffness_percent=0.3, gain_percent=0.2)
    springs = scattered(lambda rng: model.with_springs(1.0 + 0.003 * rng.standard_normal(4)).modulus(press))
    gains = scattered(lambda rng: model.modulus(press * (1.0 + 0.002 * rng.standard_normal(4))))
    assert found.contributions["stiffness"] == pytest.approx(springs, rel=STATISTICAL)
    assert found.contributions["gain"] == pytest.approx(gains, rel=STATISTICAL)


def test_a_unit_whose_channels_tell_deflections_scatters_as_told():
    """Units with springs unlike the one that the read-out knows press the fruit; each channel shows its deflection."""
    design = square_design(stiffness_percent=0.5, gain_percent=0.2, calibrated_by="plate")
    known = square_springs()
    model = measurement_model(design, square_contact(), known)
    rng = np.random.default_rng(11)
    reads = []
    for _ in range(COUNT):
        C = known / (1.0 + 0.005 * rng.standard_normal(4))
        forces = np.linalg.solve(C + square_contact().S / E, np.full(4, 0.6))
        shown = np.diag(C) * forces * (1.0 + 0.002 * rng.standard_normal(4))
        reads.append(model.modulus((shown / np.diag(known))[None]))
    press = level_press()
    found = uncertainty_sources(model, design.reading, press, press.max(axis=0), NO_POSES).contributions
    assert np.std(reads) / E == pytest.approx(np.hypot(found["stiffness"], found["gain"]), rel=STATISTICAL)


def test_noise_of_every_sample_of_a_line_counts():
    C, own = [[1.0, 0.0], [0.0, 0.05]], 0.76
    line = LineModel(C=tuple(map(tuple, C)), own_less_other=own)
    S = np.array([[0.8, 0.04], [0.04, 0.8]])
    travels = 0.6 * np.arange(1, PRESS_TRAVELS + 1) / PRESS_TRAVELS
    press = np.array([np.linalg.solve(np.array(C) + S / E, [x, x]) for x in travels])
    found = sources_of(line, press, noise_N=0.0005)
    by_force = scattered(lambda rng: line.modulus(press + 0.0005 * rng.standard_normal(press.shape)))
    assert found.contributions["noise_N"] == pytest.approx(by_force, rel=STATISTICAL)
    assert found.contributions["tip_height"] == 0.0


def test_height_of_a_tip_moves_a_square_and_not_what_is_known(model):
    """A tip that is longer by h [mm] than the read-out knows, forces in closed form."""
    h = 1e-4
    lowered = np.full(4, 0.6) + h * np.eye(4)[1]
    forces = np.linalg.solve(square_springs() + square_contact().S / E, lowered)
    off = model.modulus(forces[None]) / E - 1.0
    assert abs(off) > 1e-5
    known = model.with_heights(h * np.eye(4)[1])
    assert known.modulus(forces[None]) == pytest.approx(E, rel=1e-9)


def test_noise_for_an_uncertainty_gives_it(model):
    press = level_press()
    found = sources_of(model, press, noise_percent=0.2)
    loud = noise_to_reach(0.1, found)
    assert sources_of(model, press, noise_percent=loud).total == pytest.approx(0.1, rel=1e-6)
    assert noise_to_reach(1e-6, found) is None
