"""The rim of a cover lies on the frame."""

import math

import pytest

from cad.parts.cover_solid import cover_part
from cad.parts.housing import SETBACK_MM

KERNEL = 1e-6


def test_rim_rests_on_the_frame_alone(sensor, housing):
    part = cover_part(housing)
    foot = housing.cover_level
    walls = 2.0 * (8.0 - SETBACK_MM) * (housing.top_level - foot)
    bar = (housing.right - housing.left - 2.0 * (8.0 - SETBACK_MM)) * (6.0 - SETBACK_MM)
    assert part.face_area("rim") == pytest.approx(walls + bar - 4.0 * math.pi * 0.25 * 3.4**2, rel=1e-9)
    assert part.shape.distance(sensor.part.shape) == pytest.approx(0.0, abs=KERNEL)
    assert not part.shape.intersect(sensor.part.shape).Solids()
