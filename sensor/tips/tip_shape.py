"""The shape of a rigid tip: its outline, its meridian, and the laws by which its contact is solved.

A meridian gives the height of the surface of a tip above its lowest point. The height of a round tip is a function of
the distance from the axis. The height of a square tip is the same function of the larger of |x| and |y|. Both the gap
before contact and the solid of a pin are derived from the meridian.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple


class MeridianPoint(NamedTuple):
    """A point of a meridian: distance r from the axis [mm], and height z above the lowest point of the tip [mm]."""

    r: float
    z: float


@dataclass(frozen=True)
class Straight:
    """A straight section of a meridian."""

    start: MeridianPoint
    end: MeridianPoint


@dataclass(frozen=True)
class Arc:
    """A circular section of a meridian; the lowest point of its circle is at r = `centre_r` and z = 0 [mm]."""

    start: MeridianPoint
    end: MeridianPoint
    centre_r: float
    radius: float


def arc(start_r: float, end_r: float, centre_r: float, radius: float) -> Arc:
    """Return the arc from `start_r` to `end_r` on the circle of this radius that touches z = 0 at `centre_r` [mm]."""
    start, end = (
        MeridianPoint(r, radius - math.sqrt(max(radius**2 - (r - centre_r) ** 2, 0.0))) for r in (start_r, end_r)
    )
    return Arc(start, end, centre_r, radius)


Meridian = tuple[Straight | Arc, ...]
LEAST_PIECE_MM = 1e-6  # minimum length of a meridian section; the CAD kernel treats shorter edges as points


@dataclass(frozen=True, kw_only=True)
class TipShape(ABC):
    """The shape of a rigid tip; `side_mm` is the side of a square outline or the diameter of a round one.

    The other fields of a shape are its keys in [tips]. A user must set the keys whose fields have no default. Solvers
    and the housing use only the properties below, and reject shapes that they do not support.
    """

    name: ClassVar[str]
    is_round: ClassVar[bool] = True
    has_flat_face: ClassVar[bool] = False
    """Whether the tip ends in a plane that fills its outline except for a rounded edge: a flat punch if level."""
    obeys_hertz: ClassVar[bool] = False
    """Whether the tip is a shallow cap, whose force follows Hertz's law along the normal of the skin at any tilt.

    The contact law of domes includes the sideways deflection of the spring under this force.
    """
    touches_beside_centre: ClassVar[bool] = False
    """Whether the tip is so wide that its contact moves away from its centre on a slope."""
    pressure_exponent: ClassVar[float] = 1.0
    """The exponent n of the mean pressure under the tip, which is proportional to travel^n."""

    side_mm: float

    @property
    @abstractmethod
    def meridian(self) -> Meridian:
        """Return the sections of the meridian, from the axis to a distance of `side_mm` / 2."""

    @property
    @abstractmethod
    def sized_as(self) -> str:
        """Return the name of the sharp flat shape whose stiffness is used to size the springs.

        The flat shape has the same outline as this shape.
        """

    @property
    def is_flat(self) -> bool:
        """Return whether the tip ends in a plane with sharp edges.

        On a flat fruit, such a tip touches with its whole face or not at all.
        """
        return self.has_flat_face and len(self.meridian) == 1

    @property
    def is_solved_under_skin(self) -> bool:
        """Return whether contact on a fruit with a skin can be solved: by the law of a flat punch or by Hertz's law."""
        return self.has_flat_face or self.obeys_hertz

    @property
    def is_printed(self) -> bool:
        """Return whether the tip is printed with the housing; other tips are pins that are glued in."""
        return False

    @property
    def area_mm2(self) -> float:
        """Return the area of the outline [mm^2]."""
        return self.side_mm**2 * (math.pi / 4.0 if self.is_round else 1.0)

    @property
    def height_mm(self) -> float:
        """Return the height of the rim of the tip above its lowest point [mm]."""
        return self.meridian[-1].end.z

    @property
    def flank_deg(self) -> float:
        """Return the angle between the steepest straight section of the meridian and the horizontal [deg].

        The angle is 0 if the meridian has no straight section.
        """
        steepest = 0.0
        for piece in self.meridian:
            if isinstance(piece, Straight):
                slope_angle = math.atan2(piece.end.z - piece.start.z, piece.end.r - piece.start.r)
                steepest = max(steepest, math.degrees(slope_angle))
        return steepest

    @abstractmethod
    def contact_area_mm2(self, force: float, reduced_modulus: float, fruit_radius: float) -> float:
        """Return the contact area [mm^2] under a force [N].

        `reduced_modulus` is E / (1 - nu^2) of the fruit [MPa], and `fruit_radius` is its radius [mm].
        """
