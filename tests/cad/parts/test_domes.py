"""Domes at the ends of printed tips."""

import pytest
from squares import gentle, square_sensor

from cad.checks.part_checks import check_file
from cad.files.sensor_files import write_sensor
from sensor.design.processes import PROCESSES


@pytest.mark.slow
def test_plate_with_half_balls_is_exported_whole(tmp_path):
    """A ball's pole on the edge of a cap gives triangles without an area, which a 3MF reader refuses."""
    design = gentle(side_mm=2.0, dome_radius_mm=1.0, spacing_mm=4.0)
    write_sensor(square_sensor(design=design), tmp_path)
    verdicts = check_file(tmp_path / "housing.3mf", PROCESSES["sla-resin"])
    assert [verdict.name for verdict in verdicts if verdict.passed is not True] == []
