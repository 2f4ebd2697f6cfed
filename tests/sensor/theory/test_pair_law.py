"""The contrast of a pair: exact under any misalignment, and the ratio of a level one."""

import numpy as np
import pytest

from sensor.theory.contrast_law import ReadingError, pair_law, ratio_modulus, read_modulus
from sensor.theory.contrast_rise import RiseLaw, read_rise, select_rise
from sensor.theory.two_spring_law import PAPER_SPRINGS, fruit_stiffness

ROUND_OFF = 1e-9
C = np.diag([1.0 / 0.753, 1.0 / 17.3])  # of the paper's springs [mm/N]
S = np.array([[0.8, 0.04], [0.04, 0.8]])
S_DIFFERENCE = 0.76


def test_rise_is_the_modulus_and_the_offset_the_misalignment(rng):
    for _ in range(20):
        coupled = np.diag(1.0 / rng.uniform((0.5, 10.0), (2.0, 30.0))) + rng.uniform(0.0, 1e-3)
        E, lead = 10.0 ** rng.uniform(-0.5, 0.7), rng.uniform(-0.05, 0.05)  # the low tip travels farther by the lead
        forces = [np.linalg.solve(coupled + S / E, [travel + lead, travel]) for travel in np.linspace(0.2, 0.6, 9)]
        law = RiseLaw(contrast=pair_law(coupled.tolist(), S_DIFFERENCE))
        found = read_rise(law, select_rise(np.array(forces), 2), np.zeros(2))
        assert pytest.approx(E, rel=ROUND_OFF) == found.E
        assert found.offset == pytest.approx(lead, rel=ROUND_OFF, abs=1e-12)


def test_force_ratio_is_4_of_the_paper_and_a_lead_moves_it():
    E = 2.0
    low, high = np.linalg.solve(C + S / E, [0.6, 0.6])
    K_m = fruit_stiffness(PAPER_SPRINGS, high / low)
    assert ratio_modulus(C.tolist(), S_DIFFERENCE, (low, high)) == pytest.approx(S_DIFFERENCE * K_m, rel=ROUND_OFF)
    assert read_modulus(pair_law(C.tolist(), S_DIFFERENCE), (low, high)) == pytest.approx(E, rel=ROUND_OFF)
    tilted = np.linalg.solve(C + S / E, [0.53, 0.67])  # 1 degree over 8 mm
    assert ratio_modulus(C.tolist(), S_DIFFERENCE, tilted) > 1.3 * E
    for forces in ((high, low), (low, low)):  # a high tip on any fruit presses more than the low one
        with pytest.raises(ReadingError):
            ratio_modulus(C.tolist(), S_DIFFERENCE, forces)
