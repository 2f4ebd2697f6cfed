"""Bodies of the page: colours of a scale, springs under load."""

import numpy as np
import pytest
from stand_ins import springs_of

from mesh.housing.sweep import flexure_mesh
from pipeline.making.field_files import fields_at_full_travel
from pipeline.options import RunOptions
from pipeline.report.page.page_bodies import (
    STRESS_ERROR,
    ColourScale,
    deformation_factor,
    loaded_half,
)
from pipeline.springs.mounts import mount_layers
from sensor.design.parameters import Design
from solve.housing.clamped_half import clamped_half


def test_colours_run_from_dark_to_bright_and_are_cut_at_the_ends():
    """Relative luminance of IEC 61966-2-1 rises with the value: the scale reads without hue."""
    colours = ColourScale(label="", low=0.0, high=10.0).colours(np.linspace(-1.0, 11.0, 25))
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    assert (np.diff(linear[2:-2] @ np.array([0.2126, 0.7152, 0.0722])) > 0.0).all()
    for cut, end in ((slice(3), [0x44, 0x01, 0x54]), (slice(-3, None), [0xFD, 0xE7, 0x25])):
        np.testing.assert_allclose(255.0 * colours[cut], [end] * 3)


@pytest.mark.parametrize(
    ("largest", "length", "factor"),
    [
        (1.0, 62.5, 5.0),
        (1.0, 62.4, 2.0),
        (0.4, 78.0, 10.0),
        (8.0, 100.0, 1.0),
        (0.0, 9.0, 1.0),
    ],
)
def test_deformation_factor(largest, length, factor):
    """At most 0.08 of the length: 1, 2 or 5 times a power of ten."""
    assert deformation_factor(largest, length) == pytest.approx(factor, rel=1e-12)


def test_field_of_one_value_has_a_colour():
    assert np.isfinite(ColourScale(label="", low=2.0, high=2.0).colours(np.full(3, 2.0))).all()


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [0.001, 0.02])
def test_largest_stress_of_the_picture_is_off_by_less_than_it_says(tolerance):
    """Compare with the mesh on which the springs are solved. A rough answer has a tolerance of 0.02."""
    springs = springs_of(Design())
    process = springs.process
    fine = clamped_half(flexure_mesh(springs.housing), process.E_MPa, process.poisson, mount_layers(springs.housing))
    coarse = loaded_half(springs, RunOptions(tolerance=tolerance))
    stresses = [fields_at_full_travel(springs, half).von_mises.max() for half in (coarse, fine)]
    assert abs(stresses[0] / stresses[1] - 1.0) < STRESS_ERROR
