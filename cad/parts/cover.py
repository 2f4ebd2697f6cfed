"""The dimensions of the cover that closes the frame, and of the screws through it [mm]."""

import math

from cad.parts.housing import largest_tilt
from sensor.design.tips import Press

WASHER_MM = 7.0  # outer diameter for M3, ISO 7089
PLATE_MM = 2.0
RECESS_MM = 1.0  # twice the widest gap that a process must keep open
COVER_MM = PLATE_MM + RECESS_MM  # of plate and rim together


def cover_level(protrusion: float, press: Press) -> float:
    """Return the level of a cover's foot [mm] that stays above the edge of a frame at this level, however tilted."""
    rise = COVER_MM * math.tan(math.radians(largest_tilt(press)))
    return round(protrusion + rise, 3)
