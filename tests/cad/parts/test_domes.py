"""Domes at the ends of printed tips, and what the flat tips of the solve leave out by them."""

import math

import pytest
from squares import gentle, square_housing, square_sensor

from cad.checks.part_checks import check_file
from cad.files.sensor_files import write_sensor
from cad.parts.housing_solid import cut_domes, housing_part
from sensor.design.processes import PROCESSES

KERNEL = 1e-6  # relative, of a volume by the geometry kernel


def test_half_sphere_is_left_of_a_tip_as_wide_as_its_sphere():
    """A square above z = 0.98 r, wider than the ball, below it a cap of that height, pi h^2 (r - h / 3)."""
    design = gentle(side_mm=2.0, dome_radius_mm=1.0, spacing_mm=4.0)
    housing = square_housing(design)
    assert housing.tip_height >= 1.0
    assert housing.tip_side == 2.2
    whole, cut = housing_part(housing).shape, cut_domes(housing_part(housing), housing).shape
    taken = whole.Volume(tol=KERNEL) - cut.Volume(tol=KERNEL)
    assert taken == pytest.approx(2.0 * (0.98 * 2.2**2 - 0.98**2 * math.pi * (1.0 - 0.98 / 3.0)), rel=1e-6)


@pytest.mark.slow
def test_plate_with_half_balls_is_exported_whole(tmp_path):
    """A ball's pole on the edge of a cap gives triangles without an area, which a 3MF reader refuses."""
    design = gentle(side_mm=2.0, dome_radius_mm=1.0, spacing_mm=4.0)
    write_sensor(square_sensor(design=design), tmp_path)
    verdicts = check_file(tmp_path / "housing.3mf", PROCESSES["sla-resin"])
    assert [verdict.name for verdict in verdicts if verdict.passed is not True] == []
