"""The dimensions of the cover that closes the frame, and of the washers on it [mm]."""

import math

from cad.parts.housing import largest_tilt
from sensor.design.tips import PressMotion

WASHER_MM = 7.0  # outer diameter of a washer for M3, ISO 7089
PLATE_MM = 2.0  # thickness of the plate of a cover
RECESS_MM = 1.0  # height of the rim: twice the largest `min_gap_mm` of the processes
COVER_MM = PLATE_MM + RECESS_MM  # thickness of plate and rim together


def cover_level(protrusion: float, press: PressMotion) -> float:
    """Return the level z [mm] of the lower edge of a cover, above the lower edge of the frame at z = `protrusion` [mm].

    In every allowed tilt the lower edge of the cover stays above that of the frame, so that only the frame must clear
    the fruit.
    """
    rise = COVER_MM * math.tan(math.radians(largest_tilt(press)))
    return round(protrusion + rise, 3)
