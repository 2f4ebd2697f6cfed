"""Bands of a print: a surrogate that is exact for a power law, and bands that closed forms give."""

import math
from dataclasses import replace

import numpy as np
import pytest
from stand_ins import K_M_OVER_E, PETG, default_housing

from pipeline.verdicts.errors.print_scatter import (
    CALIBRATED,
    calibrated_error,
    fit_surrogate,
    scatter_bands,
)
from pipeline.verdicts.targets import ForceRatioCurve
from sensor.design.parameters import Targets
from sensor.theory.leaf_spring import pair_stiffness
from sensor.theory.two_spring_law import size_springs

HOUSING = default_housing()
THICKNESSES = (0.8, 1.2)
K_M = 3.5 * K_M_OVER_E
SPRINGS = size_springs(5.0, 0.05, K_M)
OWN = ForceRatioCurve(springs=SPRINGS, K_m_max=K_M)


def flexures(housing):
    return [arm.flexure for arm in housing.arms]


def beams(housing):
    """Return what the beam law gives: K goes with t^3."""
    return tuple(pair_stiffness(2000.0, leaf.depth, leaf.thickness, leaf.length) for leaf in flexures(housing))


def power(*exponents):
    return lambda housing: tuple(
        leaf.thickness**exponent for leaf, exponent in zip(flexures(housing), exponents, strict=True)
    )


@pytest.mark.parametrize("exponents", [(3.0, 3.0), (2.87, 2.57)])
def test_surrogate_of_a_power_law_is_that_power(exponents):
    surrogate = fit_surrogate(HOUSING, 0.05, power(*exponents))
    assert surrogate.slopes == pytest.approx(exponents, rel=1e-9)
    assert surrogate.curves == pytest.approx((0.0, 0.0), abs=1e-9)
    assert surrogate.corner_error == pytest.approx(0.0, abs=1e-12)


def test_bands_of_the_coarsest_process_that_is_accepted_are_finite():
    coarse = replace(PETG, accuracy_mm=0.45 * THICKNESSES[0], E_scatter=0.23)
    surrogate = fit_surrogate(HOUSING, coarse.accuracy_mm, beams)
    bands = scatter_bands(HOUSING, coarse, OWN, Targets(), surrogate)
    ends = (*bands.K_l_N_per_m, *bands.K_h_N_per_m, *bands.P_max, *bands.NL)
    assert np.isfinite(ends).all()
    assert min(ends) > 0.0


def test_springs_that_disturb_each_other_show_at_the_corners():
    """Where one stiffness depends on the other leaf the surrogate is wrong, and says by how much."""

    def coupled(housing):
        low, high = flexures(housing)
        return low.thickness**3 * high.thickness**0.5, high.thickness**3

    assert fit_surrogate(HOUSING, 0.05, coupled).corner_error > 0.02


def test_band_of_a_spring_is_that_of_its_thickness_and_modulus():
    """Small independent scatters add in squares: sigma ln K = sqrt((3 sigma_t / t)^2 + sigma_E^2)."""
    bands = scatter_bands(HOUSING, PETG, OWN, Targets(), fit_surrogate(HOUSING, PETG.accuracy_mm, beams))
    rows = zip((bands.K_l_N_per_m, bands.K_h_N_per_m), SPRINGS.stiffnesses, THICKNESSES, strict=True)
    for band, K, t in rows:
        sigma = math.hypot(3.0 * 0.5 * PETG.accuracy_mm / t, PETG.E_scatter)
        half_width = 0.5 * math.log(band[1] / band[0])
        assert half_width == pytest.approx(1.96 * sigma, rel=0.06)
        assert band[0] < 1e3 * K < band[1]


def test_band_of_the_modulus():
    """P depends on K_m / K alone: springs of another modulus, stiffer by f, read a fruit that is softer by f."""
    exact = replace(PETG, accuracy_mm=1e-6)
    bands = scatter_bands(HOUSING, exact, OWN, Targets(), fit_surrogate(HOUSING, PETG.accuracy_mm, beams))
    sigma = 1.96 * PETG.E_scatter
    # of 1,024 Sobol points a quantile is within 1 % of sigma
    assert bands.modulus_error == pytest.approx((1.0 / (1.0 + sigma) - 1.0, 1.0 / (1.0 - sigma) - 1.0), rel=0.03)
    assert np.divide(bands.K_h_N_per_m, 1e3 * SPRINGS.K_h) == pytest.approx((1.0 - sigma, 1.0 + sigma), rel=0.01)


def test_calibration_to_one_percent_leaves_the_sum_of_what_both_springs_do():
    """With a = K_m / (K_l + K_m) and b = K_m / (K_h + K_m): d ln P = -a dln K_l + b dln K_h + (a - b) dln K_m."""
    a, b = (K_M / (K + K_M) for K in SPRINGS.stiffnesses)
    # Central differences over 1 % are off by some 1e-4 of the value.
    assert calibrated_error(OWN) == pytest.approx(CALIBRATED * (a + b) / (a - b), rel=1e-3)
