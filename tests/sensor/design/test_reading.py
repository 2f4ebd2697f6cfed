"""Ranges of what a reading has to stand: those that are accepted, and limits between those that are told."""

import math

import pytest

from sensor.design.design_file import design_from_mapping
from sensor.design.reading import ReadingRequirements

EGG = {"shape": "ellipsoid", "radius_mm": 47.0, "radius_across_mm": 110.0, "length_mm": 24.0, "width_mm": 24.0}


def design_with(reading, **fruit):
    return design_from_mapping(
        {
            "fruit": {**EGG, "thickness_mm": 12.0, **fruit},
            "tips": {"layout": "square", "spacing_mm": 6.0, "shape": "dome", "dome_radius_mm": 10.0, "side_mm": 5.0},
            "springs": {"K_l_N_per_m": 150.0, "K_h_N_per_m": 1400.0},
            "reading": reading,
        }
    )


@pytest.mark.parametrize(
    ("along", "across"),
    [([42, 53], [86, 144]), ([86.0, 144.0], [42.0, 53.0]), ([47.0, 47.0], [47.0, 47.0])],
    ids=["shorter first", "longer first", "one ball"],
)
def test_either_radius_may_be_told_first(along, across):
    asked = {"radius_mm": along, "radius_across_mm": across, "thickness_mm": [8.0, 20.0], "uncertainty_limit": 0.05}
    reading = design_with(asked, radius_mm=along[0], radius_across_mm=across[0]).reading
    assert (reading.radius_mm, reading.radius_across_mm) == (tuple(along), tuple(across))
    assert (reading.thickness_mm, reading.uncertainty_limit) == ((8.0, 20.0), 0.05)


def test_one_limit_for_all_moduli():
    reading = ReadingRequirements(uncertainty_limit=0.07)
    assert [reading.uncertainty_limit_at(E, (0.5, 3.5)) for E in (0.1, 0.5, 2.0, 9.0)] == [0.07] * 4
    assert reading.least_uncertainty_limit == 0.07


def test_limits_for_each_modulus_whatever_their_order():
    """Between two moduli by the logarithm of the modulus, beyond them the nearest."""
    reading = design_with({"uncertainty_limit": [0.10, 0.05, 0.06]}, E_MPa=[3.5, 0.5, 1.0]).reading
    moduli = (3.5, 0.5, 1.0)
    found = [reading.uncertainty_limit_at(E, moduli) for E in (0.2, 0.5, math.sqrt(0.5), 1.0, math.sqrt(3.5), 3.5, 9.0)]
    assert found == pytest.approx([0.05, 0.05, 0.055, 0.06, 0.08, 0.10, 0.10])
    assert reading.least_uncertainty_limit == 0.05
