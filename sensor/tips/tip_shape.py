"""What the shape of a rigid tip decides: its outline, its meridian, and by what laws its contact is solved.

A meridian says how high the surface of a tip lies above its lowest point, from its axis outwards. A round tip has it
over the distance from the axis, a square one over the larger of |x| and |y|. The gap before contact and the solid of a
pin both follow from it.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple


class MeridianPoint(NamedTuple):
    """A point of a meridian [mm]: distance from the axis, height above the lowest point of the tip."""

    r: float
    z: float


@dataclass(frozen=True)
class Straight:
    """A straight piece of a meridian."""

    start: MeridianPoint
    end: MeridianPoint


@dataclass(frozen=True)
class Arc:
    """A piece of a meridian on a circle of a radius, whose lowest point is at r = `centre_r` and z = 0 [mm]."""

    start: MeridianPoint
    end: MeridianPoint
    centre_r: float
    radius: float


def arc(start_r: float, end_r: float, centre_r: float, radius: float) -> Arc:
    """Return the arc from `start_r` to `end_r` on the circle that touches z = 0 at `centre_r` [mm]."""
    start, end = (
        MeridianPoint(r, radius - math.sqrt(max(radius**2 - (r - centre_r) ** 2, 0.0))) for r in (start_r, end_r)
    )
    return Arc(start, end, centre_r, radius)


Meridian = tuple[Straight | Arc, ...]
LEAST_PIECE_MM = 1e-6  # of a meridian: the CAD kernel takes shorter edges for points


@dataclass(frozen=True, kw_only=True)
class TipShape(ABC):
    """A rigid tip; `side_mm` is the side of a square outline, the diameter of a round one.

    The fields of a shape other than `side_mm` are its keys in [tips]; one without a default must be given. Every
    property that a solver or the housing asks for is here: a solver refuses by it what it cannot solve.
    """

    name: ClassVar[str]
    is_round: ClassVar[bool] = True
    has_flat_face: ClassVar[bool] = False
    """The tip ends in a plane that is its outline but for a rounded edge: a level press is that of a flat punch."""
    obeys_hertz: ClassVar[bool] = False
    """The tip is a shallow cap: at any tilt its force follows Hertz's law along the normal of the skin.

    Such a force moves its spring sideways too, which the law of domes counts.
    """
    touches_beside_centre: ClassVar[bool] = False
    """The tip is so wide that on a slope its contact lies beside its centre."""
    pressure_exponent: ClassVar[float] = 1.0
    """The power of the travel to which the mean pressure under the tip is proportional."""

    side_mm: float

    @property
    @abstractmethod
    def meridian(self) -> Meridian:
        """Return the pieces of the meridian from the axis to half of `side_mm`."""

    @property
    @abstractmethod
    def sized_as(self) -> str:
        """Return the name of the shape with a sharp flat face of the same outline, whose stiffness sizes springs."""

    @property
    def is_flat(self) -> bool:
        """Say whether the tip ends in a plane with sharp edges: on a flat fruit it then touches whole or not at all."""
        return self.has_flat_face and len(self.meridian) == 1

    @property
    def is_solved_under_skin(self) -> bool:
        """Say whether contact is solved on a fruit with a skin: by the law of a flat punch, or by Hertz's law."""
        return self.has_flat_face or self.obeys_hertz

    @property
    def is_printed(self) -> bool:
        """Say whether the tip is made with the housing; other shapes are glued in as pins."""
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
        """Return the slope of the steepest straight piece of the meridian [deg], 0 where there is none."""
        steepest = 0.0
        for piece in self.meridian:
            if isinstance(piece, Straight):
                rise = math.atan2(piece.end.z - piece.start.z, piece.end.r - piece.start.r)
                steepest = max(steepest, math.degrees(rise))
        return steepest

    @abstractmethod
    def contact_area_mm2(self, force: float, reduced_modulus: float, fruit_radius: float) -> float:
        """Return the area that touches under a force [mm^2 from N, E / (1 - nu^2) in MPa, mm]."""
