"""Cells on the footprints of a scene and how far each lies from the fruit.

The cells of a curved fruit lie on the block of its plan and thickness; its shape adds the gap under each tip, and the
change that its body makes to the answer to a level press.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cad.design.fruit import Fruit
from cad.quantity import InputError
from solve.arrays import Floats
from solve.contact.cells import ContactCells, contact_cells, folded, smooth_compliance
from solve.contact.scene import Point, Scene, check_scene
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import Footprint
from solve.fruit.split import SplitDomainError, check_domain
from solve.halfspace.punch import graded_edges

# Cells a side of the coarse and the fine grid, with mirror symmetry and without.
HALF_CELLS = (18, 26)  # a side of the whole footprint, of which half is solved
WHOLE_CELLS = (14, 20)
# Pressure is singular at the edge of a flat face: along the lines of a square, across them under a cylinder.
SQUARE_GRADING = 2.5
CIRCLE_GRADING = 1.5
NO_GRADING = 1.0
SAMPLES = 201
MARGIN = 1.02
# Of the width over which an undeformed dome would enter the fruit: Hertz touches over 0.707 of it.
TOUCHED = 0.75


@dataclass(frozen=True, eq=False)
class SceneCells:
    """Cells on the footprints of a scene, their gap before the press, and what the grid misses of a level press.

    `edges` [mm] are the lines of cells from the centre of a footprint, alike along and across; `gap` (cells,) [mm]
    counts from first touch, infinite without a face; `middle` (2,) [mm] is the mean of the tips' centres.
    `compliance_correction` (tips, tips), times E [1/mm], makes the cells of flat tips answer a level press as the
    compliance does; cells of other tips get the change by the shape of the fruit alone. Where `is_half` the cells lie
    at y > 0 and stand for both sides.
    """

    cells: ContactCells
    edges: Floats
    gap: Floats
    middle: Floats
    compliance_correction: Floats
    is_half: bool

    def interference(self, scene: Scene, x: float) -> Floats:
        """Return how far the undeformed tips would enter the fruit [mm] at travel x [mm]; -inf without a face."""
        travel = housing_travel(self.cells, x, scene.press.tilt_deg, scene.press.roll_deg, self.middle)
        return np.asarray(travel - self.gap + np.array(scene.height_offsets_mm)[self.cells.owner])


def scene_cells(
    scene: Scene, compliance: FruitCompliance, farthest: float, is_half: bool | None = None
) -> tuple[SceneCells, SceneCells]:
    """Return a coarse and a fine grid of cells for travels up to `farthest` [mm]; `compliance` is that of flat tips.

    `is_half` says whether cells at y > 0 stand for both sides, as they do for a mirrored scene if it is None. Raises
    InputError when the scene is too steep, or outside the domain of the split.
    """
    footprints = scene_footprints(scene, farthest)
    if is_half is None:
        is_half = scene.mirrored
    shape = scene.tips.tip_shape
    grading = CIRCLE_GRADING if shape.is_round else SQUARE_GRADING
    if not shape.has_flat_face:
        grading = NO_GRADING
    grids = []
    for count in HALF_CELLS if is_half else WHOLE_CELLS:
        edges = graded_edges(count, grading)
        cells = _cells(scene.fruit.equivalent_block, footprints, tuple(edges.tolist()), is_half)
        gap = initial_gap(scene, scene, cells)
        correction = compliance.shape_change
        if shape.has_flat_face:
            faces = np.isfinite(gap)
            tips = cells.tips[faces]
            forces = np.linalg.solve(cells.compliance[np.ix_(faces, faces)], tips)
            correction = compliance.S - np.linalg.inv(tips.T @ forces)
        middle = np.mean(scene.centres, axis=0)
        grids.append(SceneCells(cells, footprints[0].side * edges, gap, middle, correction, is_half))
    coarse, fine = grids
    return coarse, fine


def scene_footprints(scene: Scene, farthest: float) -> tuple[Footprint, ...]:
    """Return the squares that hold all that the tips may touch for travels up to `farthest` [mm]; solves nothing.

    Raises InputError when the scene is too steep, or outside the domain of the split.
    """
    check_scene(scene)
    side = scene.tips.side_mm
    centres: Sequence[Point] = scene.centres
    if scene.tips.tip_shape.obeys_hertz:
        side, centres = _touched_squares(scene, farthest)
    elif not scene.tips.tip_shape.has_flat_face:
        side = _touched_side(scene, farthest)
    footprints = tuple(Footprint(x, y, side) for x, y in centres)
    try:
        check_domain(scene.fruit.equivalent_block, footprints)
    except SplitDomainError as outside:
        reason = str(outside).partition(" for the split")[0]
        msg = f"{reason} for contact with tilt, curvature or fillet; change the scene, or make it flat and level"
        raise InputError(msg) from outside
    return footprints


def posed(grid: SceneCells, built: Scene, scene: Scene) -> SceneCells:
    """Return the cells of the scene `built` with the gaps of another pose or radius of the fruit.

    The cells stay where they are on the block, so that one matrix serves poses near to each other.
    """
    return replace(grid, gap=initial_gap(scene, built, grid.cells))


def initial_gap(scene: Scene, built: Scene, cells: ContactCells) -> Floats:
    """Return the gap of cells that stand under the tips of the scene `built` [mm], from first touch."""
    centres = np.array(built.centres)
    moved = (np.array(scene.centres) - centres)[cells.owner]
    local = cells.points - centres[cells.owner]
    return scene.fruit_gap(*(cells.points + moved).T) + scene.tip_gap(*local.T) - scene.first_touch_mm


def housing_travel(
    cells: ContactCells, x: float, tilt_deg: float = 0.0, roll_deg: float = 0.0, middle: Floats | None = None
) -> Floats:
    """Return the travel of a rigid housing over every cell [mm], x that of its middle.

    `middle` (2,) [mm] is the mean of the tips' centres, where it is not that of the footprints. Positive tilt lowers
    the tips at +x, positive roll those at +y.
    """
    if middle is None:
        middle = cells.centres.mean(axis=0)
    along, across = (cells.points - middle).T
    return np.asarray(x + along * np.tan(np.radians(tilt_deg)) + across * np.tan(np.radians(roll_deg)))


# One scene is pressed again and again, by its own springs, the paper's, and at full travel: its cells cost 2 s.
@functools.lru_cache(maxsize=8)
def _cells(block: Fruit, footprints: tuple[Footprint, ...], edges: tuple[float, ...], is_half: bool) -> ContactCells:
    cells = contact_cells(block, footprints, np.array(edges), _smooth_compliance(block, footprints))
    return folded(cells) if is_half else cells


@functools.lru_cache(maxsize=4)
def _smooth_compliance(block: Fruit, footprints: tuple[Footprint, ...]) -> Floats:
    return smooth_compliance(block, footprints)


def _touched_points(scene: Scene, farthest: float) -> list[tuple[Floats, Floats]]:
    """Return where each undeformed tip would be in the fruit: x and y of points from its centre [mm]."""
    line = 0.5 * scene.tips.side_mm * np.linspace(-1.0, 1.0, SAMPLES)
    x, y = np.meshgrid(line, line, indexing="ij")
    middle = np.mean(scene.centres, axis=0)
    points = []
    for centre in scene.centres:
        along = centre[0] - middle[0] + x
        across = centre[1] - middle[1] + y
        travel = farthest + along * scene.turn[0] + across * scene.turn[1]
        entered = travel > scene.gap_under(centre, x, y) - scene.first_touch_mm
        points.append((x[entered], y[entered]))
    return points


def _touched_side(scene: Scene, farthest: float) -> float:
    """Return the side [mm] of a square about each tip that holds all it may touch."""
    side = scene.tips.side_mm
    reach = 0.0
    for x, y in _touched_points(scene, farthest):
        reach = max(reach, float(np.maximum(np.abs(x), np.abs(y)).max(initial=0.0)))
    step = side / (SAMPLES - 1)
    return min(side, MARGIN * 2.0 * (reach + step))


def _touched_squares(scene: Scene, farthest: float) -> tuple[float, list[Point]]:
    """Return the side [mm] and the centres [mm] of squares that hold all that each dome may touch."""
    step = scene.tips.side_mm / (SAMPLES - 1)
    side = step
    centres: list[Point] = []
    for (x, y), (along, across) in zip(_touched_points(scene, farthest), scene.centres, strict=True):
        if len(x):
            side = max(side, float(np.ptp(x)), float(np.ptp(y)))
            along += 0.5 * (x.min() + x.max())
            across += 0.5 * (y.min() + y.max())
        centres.append((along, across))
    return TOUCHED * (side + 2.0 * step), centres
