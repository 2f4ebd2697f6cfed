"""A scene of contact: fruit, tips and press; the cells of the tips and how far each lies from the fruit.

A curved fruit answers as the block of its plan and thickness, to which its shape adds the gap under each tip: its
own curvature moves K_m by 0.2 % at a radius of 35 mm, its slope under a tip far more. Travel x counts from
the first touch of a level sensor.
"""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from cad.design.parameters import Fruit, Press, Tips
from cad.quantity import InputError, fault
from solve.contact.cells import Footprints, folded, footprint_compliance
from solve.contact.gap import cap_gap, cube_gap, cylinder_gap, sphere_gap
from solve.contact.unilateral import travels
from solve.fruit.split import Foot, SplitDomainError, check_domain
from solve.halfspace.punch import graded_edges

Floats = NDArray[np.float64]

# Beyond, gaps along the press and forces across the tips are no longer a matter of small slopes: 1 / cos - 1 = 6 %.
STEEPEST_DEG = 20.0
# Cells a side of the coarse and the fine grid; with roll there is no mirror symmetry and twice as many cells.
CELLS = {"mirrored": (18, 26), "rolled": (14, 20)}
# Pressure is singular at the edge of a face: along the lines of a square, across them under a cylinder.
GRADINGS = {"cube": 2.5, "cylinder": 1.5, "sphere": 1.0}
SAMPLES = 201
MARGIN = 1.02


@dataclass(frozen=True, kw_only=True)
class Scene:
    """The fruit, the tips on it and how they are pressed."""

    fruit: Fruit
    tips: Tips
    press: Press

    @property
    def linear(self) -> bool:
        """Say whether flat sharp faces meet a flat fruit level: each then touches whole or not at all."""
        level = self.press.tilt_deg == 0.0 and self.press.roll_deg == 0.0
        return level and self.fruit.shape == "block" and self.tips.flat == self.tips

    @property
    def centres(self) -> tuple[float, float]:
        """Return x of the low and of the high tip from the apex [mm]."""
        return self.tips.centres_mm

    @property
    def slopes_deg(self) -> tuple[float, float]:
        """Return the slope of the fruit along the tips under the low and the high tip; it falls where positive."""
        low, high = (float(np.degrees(np.arctan(self._fall_rate(x)))) for x in self.centres)
        return low, high

    @property
    def steepest_deg(self) -> float:
        """Return the largest angle between a tip's face and the fruit's top under its centre."""
        tilt, roll = np.tan(np.radians([self.press.tilt_deg, self.press.roll_deg]))
        return max(float(np.degrees(np.arctan(np.hypot(self._fall_rate(x) - tilt, roll)))) for x in self.centres)

    def _fall_rate(self, x: float) -> float:
        if self.fruit.radius_mm is None:
            return 0.0
        along = x / self.fruit.radius_mm
        return along / float(np.sqrt(1.0 - along**2)) if abs(along) < 1.0 else float(np.inf)

    def fruit_gap(self, x: Floats, y: Floats) -> Floats:
        """Return how far the fruit falls away from the plane at its apex [mm]; infinity beyond it."""
        radius = self.fruit.radius_mm
        if radius is None:
            return np.zeros_like(x)
        across = self.fruit.radius_across_mm
        return cap_gap(x, y, radius, radius if across is None else across)

    def tip_gap(self, x: Floats, y: Floats) -> Floats:
        """Return the gap of a tip's own shape [mm] at places from its centre; infinity where it has no face."""
        side, fillet = self.tips.side_mm, self.tips.fillet_mm
        if self.tips.shape == "cube":
            return cube_gap(x, y, side, fillet)
        if self.tips.shape == "cylinder":
            return cylinder_gap(x, y, side, fillet)
        return sphere_gap(x, y, 0.5 * side)

    @property
    def first_touch_mm(self) -> float:
        """Return the gap at which a level sensor first touches, from the plane at the apex [mm]."""
        return min(self._least_gap(centre) for centre in self.centres)

    def _least_gap(self, centre: float) -> float:
        """Return the least gap under a tip: on its own length axis, where it is a convex function of x."""
        side = self.tips.side_mm

        def gap(t: float) -> float:
            x, y = np.array(side * t), np.zeros(())
            return float(self.fruit_gap(centre + x, y) + self.tip_gap(x, y)) / side

        inside = minimize_scalar(gap, bounds=(-0.5, 0.5), method="bounded", options={"xatol": 1e-10}).fun
        return side * min(gap(-0.5), gap(0.5), float(inside))


@dataclass(frozen=True)
class Cells:
    """Cells on the feet of a scene, their gap before the press, and what the grid misses of a level press.

    `edges` [mm] are the lines of cells from the centre of a foot, alike along and across; `gap` (cells,) [mm] counts
    from first touch, infinite without a face; `missing` (tips, tips), times E [1/mm], makes the cells answer a level
    press as the compliance does.
    """

    footprints: Footprints
    edges: Floats
    gap: Floats
    missing: Floats


def scene_cells(scene: Scene, S: Floats, farthest: float) -> tuple[Cells, Cells]:
    """Return a coarse and a fine grid of cells for travels up to `farthest` [mm]; S of shape (2, 2) [1/mm].

    Raises InputError when the scene is too steep, or outside the domain of the split.
    """
    check_scene(scene)
    side = _touched_side(scene, farthest) if scene.tips.shape == "sphere" else scene.tips.side_mm
    feet = tuple(Foot(x, side) for x in scene.centres)
    block = scene.fruit.equivalent_block
    try:
        check_domain(block, feet)
    except SplitDomainError as outside:
        reason = str(outside).partition(" for the split")[0]
        msg = f"{reason} for contact with tilt, curvature or fillet; change the scene, or make it flat and level"
        raise InputError(msg) from outside
    mirrored = scene.press.roll_deg == 0.0
    grading = GRADINGS[scene.tips.shape]
    coarse, fine = (
        _cells(scene, _footprints(block, feet, (cells, grading, mirrored)), side * graded_edges(cells, grading), S)
        for cells in CELLS["mirrored" if mirrored else "rolled"]
    )
    return coarse, fine


def check_scene(scene: Scene) -> None:
    """Raise InputError when a tip meets the fruit at more than 20 degrees, where gaps are not small-slope gaps."""
    if scene.steepest_deg > STEEPEST_DEG:
        low, high = scene.slopes_deg
        bound = (
            f"such that no tip meets the fruit at more than {STEEPEST_DEG:g} deg, here {scene.steepest_deg:.3g} deg "
            f"with slopes of the fruit of {low:.3g} and {high:.3g} deg"
        )
        remedy = "press more level, or nearer to the apex"
        raise fault("press.tilt_deg", scene.press.tilt_deg, "deg", bound, remedy)


def approach(scene: Scene, cells: Cells, x: float) -> Floats:
    """Return how far the undeformed tips would enter the fruit [mm] at travel x, per cell; -inf without a face."""
    return travels(cells.footprints, x, scene.press.tilt_deg, scene.press.roll_deg) - cells.gap


@functools.lru_cache(maxsize=8)
def _footprints(block: Fruit, feet: tuple[Foot, ...], grid: tuple[int, float, bool]) -> Footprints:
    cells, grading, mirrored = grid
    found = footprint_compliance(block, feet, graded_edges(cells, grading))
    return folded(found) if mirrored else found


def _cells(scene: Scene, footprints: Footprints, edges: Floats, S: Floats) -> Cells:
    gap = scene.fruit_gap(*footprints.places.T) + scene.tip_gap(*footprints.local.T) - scene.first_touch_mm
    count = len(footprints.centres)
    missing = np.zeros((count, count))
    if scene.tips.shape != "sphere":
        faces = np.isfinite(gap)
        tips = np.eye(count)[footprints.owner[faces]]
        forces = np.linalg.solve(footprints.compliance[np.ix_(faces, faces)], tips)
        missing = S - np.linalg.inv(tips.T @ forces)
    return Cells(footprints, edges, gap, missing)


def _touched_side(scene: Scene, farthest: float) -> float:
    """Return the side [mm] of a square about each spherical tip that holds all it may touch."""
    side = scene.tips.side_mm
    line = 0.5 * side * np.linspace(-1.0, 1.0, SAMPLES)
    x, y = np.meshgrid(line, line, indexing="ij")
    tilt, roll = np.tan(np.radians([scene.press.tilt_deg, scene.press.roll_deg]))
    reach = 0.0
    for centre in scene.centres:
        lowered = farthest + (centre - scene.tips.offset_mm + x) * tilt + y * roll
        entered = lowered > scene.fruit_gap(centre + x, y) + scene.tip_gap(x, y) - scene.first_touch_mm
        reach = max(reach, float(np.maximum(np.abs(x), np.abs(y))[entered].max(initial=0.0)))
    step = side / (SAMPLES - 1)
    return min(side, MARGIN * 2.0 * (reach + step))
