"""The dimensions of the cover that closes the frame, and of the washers under the screws [mm]."""

import math

from cad.parts.housing import largest_tilt
from sensor.design.tips import PressMotion

WASHER_MM = 7.0  # outer diameter of an M3 washer, ISO 7089
PLATE_MM = 2.0  # thickness of the plate of a cover
RECESS_MM = 1.0  # height of the rim, which is twice the largest `min_gap_mm` of all processes
COVER_MM = PLATE_MM + RECESS_MM  # total thickness of plate and rim


def cover_level(protrusion: float, press: PressMotion) -> float:
    """Return the level z [mm] of the lower edge of a cover.

    `protrusion` [mm] is the level of the lower edge of the frame. At every allowed tilt, the cover is farther from the
    fruit than the frame, so that only the clearance of the frame matters.
    """
    rise = COVER_MM * math.tan(math.radians(largest_tilt(press)))
    return round(protrusion + rise, 3)
