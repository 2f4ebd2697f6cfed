"""The dimensions of the cover that closes the frame, and of the screws through it [mm]."""

import math
from dataclasses import dataclass

from cad.design.tips import Press
from cad.parts.housing import SETBACK_MM, Housing, largest_tilt

WASHER_MM = 7.0  # outer diameter for M3, ISO 7089
PLATE_MM = 2.0
RECESS_MM = 1.0  # twice the widest gap that a process must keep open


@dataclass(frozen=True, kw_only=True)
class Cover:
    """The dimensions of the cover of one housing [mm]: the plate, its rim, and the level at which its foot ends."""

    housing: Housing
    foot_level: float
    plate: float = PLATE_MM
    recess: float = RECESS_MM
    setback: float = SETBACK_MM

    @property
    def thickness(self) -> float:
        """Return the thickness of plate and rim together [mm]."""
        return self.plate + self.recess

    @property
    def grip(self) -> float:
        """Return what the screws must span: the housing, or both plates of a square, between two covers [mm]."""
        return self.housing.stack + 2.0 * self.thickness


def cover_level(protrusion: float, press: Press) -> float:
    """Return the level of a cover's foot [mm] that stays above the edge of a frame at this level, however tilted."""
    rise = (PLATE_MM + RECESS_MM) * math.tan(math.radians(largest_tilt(press)))
    return round(protrusion + rise, 3)
