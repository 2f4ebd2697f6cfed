"""The solids of a sensor.

In the sensor frame, the x axis runs along the tips, with their midpoint at x = 0, and the y axis runs across them. The
z axis is opposite to the direction of the press, with both tip faces at z = 0. Before a press, there is a gap between
the tips and the fruit below them. The units are mm and degrees.
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
    """A housing and its solid, with the fruit, the tips and the press of its design.

    `name` is the name of the design. `seats` are the seats of a Hall read-out, or None.
    """

    housing: Housing
    part: Part
    fruit: Fruit
    tips: Tips
    press: PressMotion
    name: str = ""
    seats: HallSeats | None = None

    def printed_part(self) -> Part:
        """Return the part for the print files. If the design has a name, L, H and the name are engraved.

        The engraving is 0.3 mm deep and lies between the clamped holes, so the stiffness analysis can neglect it.
        """
        return self._engraved_part

    @cached_property
    def _engraved_part(self) -> Part:
        return engrave_name(self.part, self.housing, self.name) if self.name else self.part

    def fruit_box(self) -> cq.Shape:
        """Return a box around the undeformed fruit [mm], with its top at z = 0, shifted by the offset of the tips.

        A curved fruit lies inside this box, so the distance of a part from the box is a lower bound for its distance
        from the fruit.
        """
        return outer_box(self.fruit).translate(cq.Vector(-self.tips.offset_mm, 0.0, 0.0))
