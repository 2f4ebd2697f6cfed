"""Bands of prints, by closed forms of one spring and of fruit read by springs of another modulus."""

import math
from dataclasses import replace

import numpy as np
import pytest
from stand_ins import K_M_OVER_E, PETG, draw_sensor, springs_of

from pipeline.errors.budget import level_press
from pipeline.errors.causes import CALIBRATED
from pipeline.errors.scatter_bands import scatter_bands
from pipeline.response.scene_press import curve_moduli, scene_of
from sensor.design.parameters import Design, Targets
from sensor.theory.two_spring_law import force_ratio, nonlinearity

THICKNESSES = (0.8, 1.2)
K_M = 3.5 * K_M_OVER_E
DESIGN = Design()
SPRINGS = springs_of(DESIGN).stiffnesses
EXACT = 1e-6  # the least scatter that a process may have, [mm] and [1]


def bands_of(design=DESIGN, *, made=True, **process):
    """Return the bands of a design as a changed process prints it."""
    springs = replace(springs_of(design, made=made), process=replace(PETG, **process))
    pair = draw_sensor(design, springs).pair
    travel = np.array([0.3, design.press.travel_mm])
    return scatter_bands(pair, level_press(pair, curve_moduli(scene_of(design)), travel))


def test_springs_that_are_not_made_have_no_bands():
    assert bands_of(made=False) is None


def test_bands_of_the_coarsest_process_that_is_accepted_are_finite():
    bands = bands_of(accuracy_mm=0.45 * THICKNESSES[0], E_scatter=0.23)
    ends = (*bands.K_l_N_per_m, *bands.K_h_N_per_m, *bands.P_max, *bands.NL)
    assert np.isfinite(ends).all()
    assert min(ends) > 0.0


def test_band_has_no_end_where_one_print_in_forty_shows_a_P_that_the_nominal_springs_never_do():
    """At NL 0.4 P is below K_h / K_l = 5.5, and leaves thinner by 0.2 mm have a K_h / K_l that is larger by a third."""
    low, high = bands_of(Design(targets=Targets(NL=0.4)), accuracy_mm=0.2).modulus_error
    assert -1.0 < low < -0.2
    assert high is None


def test_band_of_a_spring_is_that_of_its_thickness_and_modulus():
    """Small independent scatters add in squares: sigma ln K = sqrt((3 sigma_t / t)^2 + sigma_E^2)."""
    bands = bands_of()
    rows = zip((bands.K_l_N_per_m, bands.K_h_N_per_m), SPRINGS.stiffnesses, THICKNESSES, strict=True)
    for band, K, t in rows:
        sigma = math.hypot(3.0 * 0.5 * PETG.accuracy_mm / t, PETG.E_scatter)
        half_width = 0.5 * math.log(band[1] / band[0])
        assert half_width == pytest.approx(1.96 * sigma, rel=0.06)
        assert band[0] < 1e3 * K < band[1]


def test_bands_of_a_modulus():
    """P depends on K_m / K only: springs of another modulus, stiffer by f, read a fruit that is softer by f."""
    bands = bands_of(accuracy_mm=EXACT)
    sigma = 1.96 * PETG.E_scatter
    # of 1,024 Sobol points a quantile is within 1 % of sigma
    assert np.divide(bands.K_h_N_per_m, 1e3 * SPRINGS.K_h) == pytest.approx((1.0 - sigma, 1.0 + sigma), rel=0.01)
    # crosstalk, which the law of two springs leaves out, is 1.4 % of the fruit's compliance
    assert bands.modulus_error == pytest.approx((1.0 / (1.0 + sigma) - 1.0, 1.0 / (1.0 - sigma) - 1.0), rel=0.03)
    soft, stiff = (SPRINGS.scaled((factor, factor)) for factor in (1.0 - sigma, 1.0 + sigma))
    assert bands.P_max == pytest.approx((force_ratio(stiff, K_M), force_ratio(soft, K_M)), rel=0.01)
    assert pytest.approx((nonlinearity(stiff, K_M), nonlinearity(soft, K_M)), rel=0.02) == bands.NL


def test_calibration_to_one_percent_leaves_the_sum_of_what_both_springs_do():
    """With a = K_m / (K_l + K_m) and b = K_m / (K_h + K_m): d ln P = -a dln K_l + b dln K_h + (a - b) dln K_m."""
    a, b = (K_M / (K + K_M) for K in SPRINGS.stiffnesses)
    # differences over 1 % are wrong by some 1e-4 of the value, and crosstalk is a hundredth of the compliance
    assert bands_of().calibrated_modulus_error == pytest.approx(CALIBRATED * (a + b) / (a - b), rel=2e-3)
