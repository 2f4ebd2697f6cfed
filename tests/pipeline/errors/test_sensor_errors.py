"""Bands of a modulus that is read, and the law of the force ratio over the fruit: by their formulas."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.errors.sensor_errors import table_of_readings
from pipeline.errors.targets import ForceRatioCurve
from pipeline.reading.analysis import ModulusAccuracy
from pipeline.reading.poses import Placement
from pipeline.reading.uncertainty import UncertaintySources
from sensor.quantity import Estimate
from sensor.theory.two_spring_law import Springs

SPRINGS = Springs(K_l=0.9, K_h=20.0)


def read(E, bias, noise, slope):
    """Return a row of readings of one source of uncertainty."""
    sources = UncertaintySources(contributions={"noise_N": noise}, stiffness_slope=slope, noise_slope=1.0)
    found = Estimate(bias, 0.0)
    return ModulusAccuracy(E=E, bias=found, worst=Placement(), reach=found, sources=sources, uncertainty_limit=0.1)


def test_bands_of_readings():
    """They are the bias and two sigma, and as printed springs that are off by 20 %; widths are linear in ln E."""
    rows = (read(0.5, -0.02, 0.03, 1.5), read(2.0, 0.04, 0.05, 1.2))
    E = np.array([1e-9, 0.5, 1.0, 2.0])
    curve = SimpleNamespace(P=np.ones((4, 3)), E=E)
    table = table_of_readings(curve, SimpleNamespace(moduli=rows), SimpleNamespace(largest_spring_error=0.2))
    for bands, widths in (
        (table.calibrated, (0.02 + 0.06, 0.04 + 0.1)),
        (table.printed, (0.02 + math.hypot(0.06, 0.3), 0.04 + math.hypot(0.1, 0.24))),
    ):
        width = np.array([widths[0], 0.5 * sum(widths), widths[1]])
        assert bands[1:, -1, 0] == pytest.approx(E[1:] * (1.0 - width), rel=1e-12)
        assert bands[1:, -1, 1] == pytest.approx(E[1:] * (1.0 + width), rel=1e-12)
        assert np.isnan(bands[0]).all()
        assert np.isnan(bands[:, :-1]).all()
    wide = table_of_readings(curve, SimpleNamespace(moduli=rows), SimpleNamespace(largest_spring_error=1.0))
    assert wide.printed[1:, -1, 0].tolist() == [0.0, 0.0, 0.0]  # springs that are off by 100 % move E by 120 % and more
    assert wide.printed[-1, -1, 1] == pytest.approx(2.0 * (1.04 + math.hypot(0.1, 1.2)), rel=1e-12)
    unread = table_of_readings(curve, SimpleNamespace(moduli=()), SimpleNamespace(largest_spring_error=0.2))
    assert np.isnan(unread.printed).all()


def test_fruit_stiffness_of_a_ratio():
    """Beyond what the springs show it is 0 or infinite."""
    law = ForceRatioCurve(springs=SPRINGS, K_m_max=3.0, stiffness_ratio=1.1)
    inside = 1.1 * 20.0 / 1.1 / (20.0 / 1.1 + 2.0) * (0.9 + 2.0) / 0.9  # P of K_m 2, the high tip on 1.1 times it
    assert law.fruit_stiffness(inside) == pytest.approx(2.0, rel=1e-9)
    assert (law.fruit_stiffness(1.1), law.fruit_stiffness(20.0 / 0.9)) == (0.0, math.inf)


def test_error_of_a_ratio_off_the_middle():
    """There an error of the fruit parts both tips too: by the slopes of ln P over K_m and over the stiffness ratio."""
    K_m, ratio, error = 3.0, 1.25, 0.004
    law = ForceRatioCurve(springs=SPRINGS, K_m_max=K_m, K_m_error=error * K_m, stiffness_ratio=ratio)
    under_low = K_m / (K_m + SPRINGS.K_l)
    of_high = SPRINGS.K_h / (ratio * K_m + SPRINGS.K_h)  # d ln F_h over either
    of_fruit = abs(of_high - (1.0 - under_low))
    assert law.P_max().relative == pytest.approx(error * (of_fruit + of_high), rel=1e-4)
