"""The printable housing: frame, two flexures and two tips in one plate; its levels, its profile, its solid.

Sensor frame: x along the tips, low tip at -x; z against the press, both tip faces at z = 0; y across, the
plate lies in |y| <= depth / 2. All lengths in mm.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cadquery as cq

from cad.parts.part import Part, named_part
from cad.quantity import fault
from cad.theory.flexure import Flexure

Point = tuple[float, float]
_NEAR = 1e-6
_REMEDY = "choose another process, other tips or other targets"


@dataclass(frozen=True, kw_only=True)
class Housing:
    """Every dimension of the housing [mm]; levels are heights z above the tip faces; gauges by their name.

    Where pins stand out, the tip is their foot: levels are heights above its face, and z = -pin_out touches.
    """

    low: Flexure
    high: Flexure
    tip_side: float
    tip_height: float
    spacing: float
    shuttle_width: float
    neck_level: float
    lower_leaf_level: float
    low_top_level: float
    high_top_level: float
    cavity_level: float
    top_level: float
    protrusion: float
    wall_width: float = 8.0
    hole_diameter: float = 3.4
    hole_inset: float = 4.5
    gauges: str = "none"
    pin_side: float = 0.0
    pin_round: bool = False
    pin_out: float = 0.0
    pocket_side: float = 0.0
    pocket_depth: float = 0.0

    def __post_init__(self) -> None:
        """Refuse dimensions that do not make one plate: leaves, tips and levels that run into each other."""
        half = 0.5 * max(self.low.thickness, self.high.thickness) + self.low.fillet
        upper = self.lower_leaf_level + max(self.low.separation, self.high.separation) + half
        for name, low, high in (
            ("tip_side", 0.0, min(self.depth, self.shuttle_width)),
            ("shuttle_width", 0.0, self.spacing),
            ("tip_height", 0.0, self.neck_level),
            ("neck_level", self.tip_height, self.lower_leaf_level - half),
            ("protrusion", 0.0, self.lower_leaf_level - half),
            ("low_top_level", upper, self.cavity_level),
            ("high_top_level", upper, self.cavity_level),
            ("cavity_level", upper + self.low.fillet, self.top_level),
            ("hole_diameter", 0.0, min(self.wall_width, 2.0 * self.hole_inset)),
            *self._pocket_bounds(),
        ):
            key, value, closed = f"housing.{name}", getattr(self, name), name == "tip_side"
            if not (low < value < high or (closed and value == high)):
                bound = f"greater than {low:g} mm and {'at most' if closed else 'less than'} {high:g} mm"
                raise fault(key, value, "mm", bound, _REMEDY)
        for name in ("depth", "fillet"):
            key, value, other = f"housing.high.{name}", getattr(self.high, name), getattr(self.low, name)
            if value != other:
                raise fault(key, value, "mm", f"that of the low flexure, {other:g} mm", _REMEDY)

    def _pocket_bounds(self) -> tuple[tuple[str, float, float], ...]:
        """Return name, least and largest of what makes a pocket in the foot of a pin; none for a printed tip."""
        if self.pin_side == self.pin_out == self.pocket_side == self.pocket_depth == 0.0:
            return ()
        return (
            ("pin_side", 0.0, math.inf),
            ("pin_out", 0.0, math.inf),
            ("pocket_side", self.pin_side, 0.5 * self.tip_side),
            ("pocket_depth", 0.0, self.neck_level),
        )

    @property
    def depth(self) -> float:
        """Return the depth of the plate, common to both flexures."""
        return self.low.depth

    @property
    def low_root(self) -> tuple[float, float]:
        """Return x of the low leaves at the wall and at the shuttle."""
        shuttle = -0.5 * (self.spacing + self.shuttle_width)
        return shuttle - self.low.length, shuttle

    @property
    def high_root(self) -> tuple[float, float]:
        """Return x of the high leaves at the wall and at the shuttle."""
        shuttle = 0.5 * (self.spacing + self.shuttle_width)
        return shuttle + self.high.length, shuttle

    @property
    def arms(self) -> tuple[tuple[str, Flexure, Point], tuple[str, Flexure, Point]]:
        """Return side, flexure and x of the roots at wall and shuttle, low then high."""
        return ("low", self.low, self.low_root), ("high", self.high, self.high_root)

    @property
    def left(self) -> float:
        """Return x of the outer left face."""
        return self.low_root[0] - self.wall_width

    @property
    def right(self) -> float:
        """Return x of the outer right face."""
        return self.high_root[0] + self.wall_width

    @property
    def holes(self) -> tuple[Point, ...]:
        """Return the centres (x, z) of the four mounting holes."""
        columns = (self.left + 0.5 * self.wall_width, self.right - 0.5 * self.wall_width)
        rows = (self.protrusion + self.hole_inset, self.top_level - self.hole_inset)
        return tuple((x, z) for x in columns for z in rows)

    def depth_share(self, z: float) -> float:
        """Return the share of the depth that is solid at height z of a tip or neck; 1 above the neck."""
        share = self.tip_side / self.depth
        rise = (z - self.tip_height) / (self.neck_level - self.tip_height)
        return share + (1.0 - share) * min(1.0, max(0.0, rise))


def _shuttle_side(housing: Housing, sign: float, *, outer: bool) -> list[Point]:
    """Return the way down from the neck to the tip face on one side of a shuttle."""
    centre = sign * 0.5 * housing.spacing
    away = sign if outer else -sign
    half, tip = away * 0.5 * housing.shuttle_width, away * 0.5 * housing.tip_side
    return [(centre + half, housing.neck_level), (centre + tip, housing.tip_height), (centre + tip, 0.0)]


def _arm(housing: Housing, sign: float) -> list[Point]:
    """Return the outline from the wall's foot over lower leaf, tip, shuttle and upper leaf to the cavity corner."""
    _, flexure, (wall, shuttle) = housing.arms[0 if sign < 0 else 1]
    top = housing.low_top_level if sign < 0 else housing.high_top_level
    half = 0.5 * flexure.thickness
    lower, upper = housing.lower_leaf_level - half, housing.lower_leaf_level + flexure.separation + half
    inner = sign * 0.5 * (housing.spacing - housing.shuttle_width)
    return [
        (wall, housing.protrusion), (wall, lower), (shuttle, lower),
        *_shuttle_side(housing, sign, outer=True), *reversed(_shuttle_side(housing, sign, outer=False)),
        (inner, top), (shuttle, top), (shuttle, upper), (wall, upper), (wall, housing.cavity_level),
    ]  # fmt: skip


def _outline(housing: Housing) -> list[Point]:
    outside = [
        (housing.right, housing.protrusion), (housing.right, housing.top_level),
        (housing.left, housing.top_level), (housing.left, housing.protrusion),
    ]  # fmt: skip
    return [*_arm(housing, -1.0), *reversed(_arm(housing, 1.0)), *outside]


def _windows(housing: Housing) -> list[tuple[Point, Point]]:
    """Return the corners of the two windows between the leaves."""
    found = []
    for _, flexure, roots in housing.arms:
        lower = housing.lower_leaf_level + 0.5 * flexure.thickness
        upper = housing.lower_leaf_level + flexure.separation - 0.5 * flexure.thickness
        found.append(((min(roots), lower), (max(roots), upper)))
    return found


def fillet_corners(housing: Housing) -> list[Point]:
    """Return the (x, z) of every corner that is rounded: eight a flexure and the two of the cavity."""
    corners = [(x, housing.cavity_level) for x in (housing.low_root[0], housing.high_root[0])]
    for _, flexure, roots in housing.arms:
        half = 0.5 * flexure.thickness
        for level in (housing.lower_leaf_level, housing.lower_leaf_level + flexure.separation):
            corners += [(x, level + side) for x in roots for side in (-half, half)]
    return corners


def _plate(housing: Housing) -> cq.Shape:
    """Return the plate before its tips are narrowed: the profile extruded over the whole depth."""
    back = cq.Workplane("XZ", origin=(0.0, 0.5 * housing.depth, 0.0))
    plate = back.polyline(_outline(housing)).close().extrude(housing.depth)
    for (x0, z0), (x1, z1) in _windows(housing):
        centre = (0.5 * (x0 + x1), 0.5 * (z0 + z1))
        plate = plate.cut(back.center(*centre).rect(x1 - x0, z1 - z0).extrude(housing.depth))
    drill = back.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter)
    solid = plate.cut(drill.extrude(housing.depth)).findSolid()
    corners = fillet_corners(housing)
    edges = [edge for edge in solid.Edges() if is_upright_at(edge, corners)]
    if len(edges) != len(corners):
        msg = f"housing: {len(edges)} leaf-root edges found, must be {len(corners)}; check the levels of the housing"
        raise ValueError(msg)
    rounded: cq.Shape = solid.fillet(housing.low.fillet, edges)
    return rounded


def is_upright_at(edge: cq.Edge, corners: Sequence[Point]) -> bool:
    """Say whether an edge runs straight over the depth at one of the corners (x, z) [mm]."""
    box = edge.BoundingBox()
    if edge.geomType() != "LINE" or max(box.xlen, box.zlen) > _NEAR:
        return False
    return any(abs(box.center.x - x) < _NEAR and abs(box.center.z - z) < _NEAR for x, z in corners)


def _beside_tips(housing: Housing) -> cq.Workplane | None:
    """Return what the 45 degree taper of the necks takes from the plate, or None where the tip is as deep as it."""
    deep, tip = 0.5 * housing.depth, 0.5 * housing.tip_side
    if deep - tip < _NEAR:
        return None
    away = deep + 1.0
    taper = [(tip, housing.tip_height), (deep, housing.neck_level)]
    section = [(tip, -1.0), *taper, (away, housing.neck_level), (away, -1.0)]
    reach = 0.5 * (housing.spacing + housing.shuttle_width) + 0.25 * housing.low.fillet
    wedge = cq.Workplane("YZ", origin=(-reach, 0.0, 0.0)).polyline(section).close().extrude(2.0 * reach)
    return wedge.union(wedge.mirror("XZ"))


def housing_part(housing: Housing) -> Part:
    """Return the housing as one solid with its faces `low_tip`, `high_tip` and `mounting_holes`."""
    plate = cq.Workplane(obj=_plate(housing))
    wedges = _beside_tips(housing)
    shape = (plate.cut(wedges) if wedges is not None else plate).findSolid()
    return named_housing(shape.Solids()[0] if len(shape.Solids()) == 1 else shape, housing)


def named_housing(shape: cq.Shape, housing: Housing) -> Part:
    """Return a solid of the housing, perhaps read from a file, with its faces found again by their place.

    Raises ValueError when a name matches no face.
    """
    half = 0.5 * housing.spacing

    def is_tip(sign: float) -> Callable[[cq.Face], bool]:
        def belongs(face: cq.Face) -> bool:
            centre = face.Center()
            return abs(centre.z) < _NEAR and abs(centre.x - sign * half) < 0.5 * housing.tip_side

        return belongs

    radius = 0.5 * housing.hole_diameter
    return named_part(
        "housing",
        shape,
        {
            "low_tip": is_tip(-1.0),
            "high_tip": is_tip(1.0),
            "mounting_holes": lambda face: face.geomType() == "CYLINDER" and _is_round(face, radius),
        },
    )


def _is_round(face: cq.Face, radius: float) -> bool:
    """Say whether a cylinder face closes around: a hole, not a fillet."""
    box = face.BoundingBox()
    return abs(box.xlen - 2.0 * radius) < _NEAR and abs(box.zlen - 2.0 * radius) < _NEAR
