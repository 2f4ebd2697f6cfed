"""The solids of a sensor.

Sensor frame: x runs along the tips with their midpoint at 0, y across, and z against the press with both tip faces at
z = 0. Before a press the fruit is below the tips by the gap. Units: mm, degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cadquery as cq

from cad.parts.engraving import engrave_name
from cad.parts.fruit import outer_box
from cad.parts.hall_seats import HallSeats
from cad.parts.housing import Housing
from cad.parts.part import Part
from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips


@dataclass(frozen=True, kw_only=True)
class SensorSolids:
    """A housing with its solid, its fruit, tips and press, and the seats of a Hall read-out, if any."""

    housing: Housing
    part: Part
    fruit: Fruit
    tips: Tips
    press: PressMotion
    name: str = ""
    seats: HallSeats | None = None

    def printed_part(self) -> Part:
        """Return the part for the print files, with L, H and the name of the design engraved if there is a name.

        The engraving is 0.3 mm deep and lies between the clamped holes, so the analysis of stiffness leaves it out.
        """
        return self._engraved_part

    @cached_property
    def _engraved_part(self) -> Part:
        """Return the engraved part, cached."""
        return engrave_name(self.part, self.housing, self.name) if self.name else self.part

    def fruit_box(self) -> cq.Shape:
        """Return a box around the undeformed fruit with its top at z = 0, at the offset of the tips [mm].

        A curved fruit lies inside this box, so distances from the box are not larger than those from the fruit.
        """
        return outer_box(self.fruit).translate(cq.Vector(-self.tips.offset_mm, 0.0, 0.0))
