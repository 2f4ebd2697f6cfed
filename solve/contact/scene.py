"""A scene of contact: fruit, tips and press; the cells of the tips and how far each lies from the fruit.

The cells of a curved fruit lie on the block of its plan and thickness; its shape adds the gap under each tip, and the
change that its body makes to the answer to a level press. Travel x counts from
the first touch of a level sensor.
"""

import functools
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from cad.quantity import InputError, fault
from solve.arrays import Floats
from solve.contact.cells import ContactCells, contact_cells, folded, smooth_compliance
from solve.contact.gap import cube_gap, cylinder_gap, sphere_gap
from solve.contact.unilateral import housing_travel
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import Footprint
from solve.fruit.skin import cap_gap, cap_slope
from solve.fruit.split import SplitDomainError, check_domain
from solve.halfspace.punch import graded_edges

Place = tuple[float, float]

# Beyond, gaps along the press and forces across the tips are no longer a matter of small slopes: 1 / cos - 1 = 6 %.
STEEPEST_DEG = 20.0
# Cells a side of the coarse and the fine grid; without mirror symmetry there are twice as many cells.
CELLS = {"mirrored": (18, 26), "rolled": (14, 20)}
# Pressure is singular at the edge of a face: along the lines of a square, across them under a cylinder.
GRADINGS = {"cube": 2.5, "cylinder": 1.5, "sphere": 1.0}
SAMPLES = 201
MARGIN = 1.02


@dataclass(frozen=True, kw_only=True)
class Scene:
    """The fruit, the tips on it and how they are pressed.

    `ahead_mm` is how far each tip stands before the level plane of the sensor, at most 0: the foremost tip touches
    first. No entries stand for tips that are level.
    """

    fruit: Fruit
    tips: Tips
    press: Press
    ahead_mm: tuple[float, ...] = ()

    @property
    def linear(self) -> bool:
        """Say whether flat sharp faces meet a flat fruit level: each then touches whole or not at all."""
        level = self.press.tilt_deg == 0.0 and self.press.roll_deg == 0.0
        return level and self.fruit.shape == "block" and self.tips.flat == self.tips

    @property
    def mirrored(self) -> bool:
        """Say whether the contact is alike on both sides of the plane y = 0 through all tips."""
        return self.press.roll_deg == 0.0 and all(y == 0.0 for _, y in self.centres)

    @property
    def centres(self) -> tuple[Place, ...]:
        """Return x and y of the tips from the apex [mm]."""
        return tuple((x, 0.0) for x in self.tips.centres_mm)

    @property
    def slopes_deg(self) -> tuple[float, ...]:
        """Return the slope of the fruit along the tips under each of them [deg]; it falls where positive."""
        return tuple(float(np.degrees(np.arctan(self._fruit_slope(centre)[0]))) for centre in self.centres)

    @property
    def steepest_deg(self) -> float:
        """Return the largest angle between a tip's face and the fruit's top under its centre [deg]."""
        slopes = np.array([self._fruit_slope(centre) for centre in self.centres]) - self._turn
        return float(np.degrees(np.arctan(np.hypot(*slopes.T))).max())

    @property
    def _turn(self) -> Floats:
        return np.tan(np.radians([self.press.tilt_deg, self.press.roll_deg]))

    @property
    def _radii(self) -> Place | None:
        along, across = self.fruit.radius_mm, self.fruit.radius_across_mm
        return None if along is None else (along, along if across is None else across)

    def _fruit_slope(self, place: Place) -> Place:
        return (0.0, 0.0) if self._radii is None else cap_slope(*place, *self._radii)

    def fruit_gap(self, x: Floats, y: Floats) -> Floats:
        """Return how far the fruit falls away from the plane at its apex [mm]; infinity beyond it."""
        return np.zeros_like(x) if self._radii is None else cap_gap(x, y, *self._radii)

    def tip_gap(self, x: Floats, y: Floats) -> Floats:
        """Return the gap of a tip's own shape [mm] at places from its centre [mm]; infinity where it has no face."""
        side, fillet = self.tips.side_mm, self.tips.fillet_mm
        if self.tips.shape == "cube":
            return cube_gap(x, y, side, fillet)
        if self.tips.shape == "cylinder":
            return cylinder_gap(x, y, side, fillet)
        return sphere_gap(x, y, 0.5 * side)

    def gap_under(self, centre: Place, x: Floats, y: Floats) -> Floats:
        """Return the gap [mm] between the plane at the apex and fruit plus tip, at places from a tip's centre [mm]."""
        return self.fruit_gap(centre[0] + x, centre[1] + y) + self.tip_gap(x, y)

    @property
    def first_touch_mm(self) -> float:
        """Return the gap at which a level sensor first touches, from the plane at the apex [mm]."""
        return min(self._least_gap(centre) for centre in self.centres)

    def _least_gap(self, centre: Place) -> float:
        """Return the least gap under a tip [mm], a convex function over its face."""
        side = self.tips.side_mm

        def gap(place: Floats) -> float:
            inside = np.clip(place, -0.5, 0.5)
            if self.tips.shape != "cube":
                inside = place / max(1.0, 2.0 * float(np.hypot(*place)))
            return float(self.gap_under(centre, *(side * inside))) / side

        towards_apex = -0.1 * np.sign(centre)
        simplex = np.array([towards_apex, *(towards_apex + 0.2 * np.eye(2))])
        return side * float(
            minimize(
                gap,
                towards_apex,
                method="Nelder-Mead",
                options={"initial_simplex": simplex, "xatol": 1e-9, "fatol": 1e-14},
            ).fun
        )


@dataclass(frozen=True, eq=False)
class SceneCells:
    """Cells on the footprints of a scene, their gap before the press, and what the grid misses of a level press.

    `edges` [mm] are the lines of cells from the centre of a tip, alike along and across; `gap` (cells,) [mm] counts
    from first touch, infinite without a face; `compliance_correction` (tips, tips), times E [1/mm],
    makes the cells of flat tips answer a level press as the compliance does; cells of spheres get the change by the
    shape of the fruit alone.
    """

    cells: ContactCells
    edges: Floats
    gap: Floats
    compliance_correction: Floats


def scene_cells(scene: Scene, compliance: FruitCompliance, farthest: float) -> tuple[SceneCells, SceneCells]:
    """Return a coarse and a fine grid of cells for travels up to `farthest` [mm]; `compliance` is that of flat tips.

    Raises InputError when the scene is too steep, or outside the domain of the split.
    """
    footprints = scene_footprints(scene, farthest)
    counts = CELLS["mirrored" if scene.mirrored else "rolled"]
    lines = tuple(tuple(graded_edges(count, GRADINGS[scene.tips.shape]).tolist()) for count in counts)
    grids = _grids(scene.fruit.equivalent_block, footprints, lines, scene.mirrored)
    coarse, fine = (
        _gaps(scene, cells, footprints[0].side * np.array(edges), compliance)
        for cells, edges in zip(grids, lines, strict=True)
    )
    return coarse, fine


def scene_footprints(scene: Scene, farthest: float) -> tuple[Footprint, ...]:
    """Return the squares that hold all that the tips may touch for travels up to `farthest` [mm]; solves nothing.

    Raises InputError when the scene is too steep, or outside the domain of the split.
    """
    check_scene(scene)
    side = _touched_side(scene, farthest) if scene.tips.shape == "sphere" else scene.tips.side_mm
    footprints = tuple(Footprint(x, y, side) for x, y in scene.centres)
    try:
        check_domain(scene.fruit.equivalent_block, footprints)
    except SplitDomainError as outside:
        reason = str(outside).partition(" for the split")[0]
        msg = f"{reason} for contact with tilt, curvature or fillet; change the scene, or make it flat and level"
        raise InputError(msg) from outside
    return footprints


def check_scene(scene: Scene) -> None:
    """Raise InputError when a tip meets the fruit at more than 20 deg, where gaps are not small-slope gaps."""
    if scene.steepest_deg > STEEPEST_DEG:
        bound = (
            f"such that no tip meets the fruit at more than {STEEPEST_DEG:g} deg, here {scene.steepest_deg:.3g} deg "
            f"with slopes of the fruit of {joined(scene.slopes_deg)} deg"
        )
        remedy = "press more level, or nearer to the apex"
        raise fault("press.tilt_deg", scene.press.tilt_deg, "deg", bound, remedy)


def joined(values: tuple[float, ...]) -> str:
    """Return values with three digits, in words."""
    return " and ".join(f"{value:.3g}" for value in values)


def interference(scene: Scene, grid: SceneCells, x: float) -> Floats:
    """Return how far the undeformed tips would enter the fruit [mm] at travel x [mm], per cell; -inf without a face."""
    lowered = housing_travel(grid.cells, x, scene.press.tilt_deg, scene.press.roll_deg) - grid.gap
    return lowered + np.array(scene.ahead_mm)[grid.cells.owner] if scene.ahead_mm else lowered


# One scene is pressed again and again, by its own springs, the paper's, and at full travel: its cells cost 2 s.
@functools.lru_cache(maxsize=4)
def _grids(
    block: Fruit, footprints: tuple[Footprint, ...], lines: tuple[tuple[float, ...], ...], mirrored: bool
) -> tuple[ContactCells, ...]:
    smooth = smooth_compliance(block, footprints)
    grids = (contact_cells(block, footprints, np.array(edges), smooth) for edges in lines)
    return tuple(folded(cells) if mirrored else cells for cells in grids)


def _gaps(scene: Scene, cells: ContactCells, edges: Floats, compliance: FruitCompliance) -> SceneCells:
    gap = scene.fruit_gap(*cells.places.T) + scene.tip_gap(*cells.local.T) - scene.first_touch_mm
    correction = compliance.shape_change
    if scene.tips.shape != "sphere":
        faces = np.isfinite(gap)
        tips = cells.tips[faces]
        forces = np.linalg.solve(cells.compliance[np.ix_(faces, faces)], tips)
        correction = compliance.S - np.linalg.inv(tips.T @ forces)
    return SceneCells(cells, edges, gap, correction)


def _touched_side(scene: Scene, farthest: float) -> float:
    """Return the side [mm] of a square about each spherical tip that holds all it may touch."""
    side = scene.tips.side_mm
    line = 0.5 * side * np.linspace(-1.0, 1.0, SAMPLES)
    x, y = np.meshgrid(line, line, indexing="ij")
    middle = np.mean(scene.centres, axis=0)
    reach = 0.0
    for centre in scene.centres:
        along, across = centre[0] - middle[0] + x, centre[1] - middle[1] + y
        lowered = farthest + along * scene._turn[0] + across * scene._turn[1]
        entered = lowered > scene.gap_under(centre, x, y) - scene.first_touch_mm
        reach = max(reach, float(np.maximum(np.abs(x), np.abs(y))[entered].max(initial=0.0)))
    step = side / (SAMPLES - 1)
    return min(side, MARGIN * 2.0 * (reach + step))
