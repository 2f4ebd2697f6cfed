"""What a sensor is put together of.

Sensor frame: x along the tips with their midpoint at 0, z against the press with both tip faces at z = 0,
y across. The fruit waits below the tips by the gap. Units: mm, degrees.
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
from sensor.design.tips import Press, Tips


@dataclass(frozen=True, kw_only=True)
class SensorSolids:
    """A housing with its solid, the fruit that it is pressed on, and the seats of a Hall read-out where it has one."""

    housing: Housing
    part: Part
    fruit: Fruit
    tips: Tips
    press: Press
    name: str = ""
    seats: HallSeats | None = None

    def printed_part(self) -> Part:
        """Return the part as the print files hold it: with L, H and the name engraved in the frame, if there is one.

        The engraving lies between the clamped holes, 0.3 mm deep: what is solved leaves it out.
        """
        return self._marked

    @cached_property
    def _marked(self) -> Part:
        """Return the marked part, cut once."""
        return engrave_name(self.part, self.housing, self.name) if self.name else self.part

    def fruit_box(self) -> cq.Shape:
        """Return the undeformed fruit as a plain box whose top is z = 0, below the tips of the sensor frame.

        A curved fruit lies inside this box: it falls away from its apex.
        """
        return outer_box(self.fruit).translate(cq.Vector(-self.tips.offset_mm, 0.0, 0.0))
