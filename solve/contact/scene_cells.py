"""Cells on the footprints of a scene and how far each lies from the fruit.

The cells of a curved fruit lie on the block of its plan and thickness; its shape adds the gap under each tip, and the
change that its body makes to the answer to a level press.
"""

import functools
from dataclasses import dataclass, replace

import numpy as np

from cad.design.fruit import Fruit
from cad.quantity import InputError
from cad.tips.tip_shape import TipShape
from solve.arrays import Floats
from solve.contact.cells import ContactCells, contact_cells, folded, smooth_compliance
from solve.contact.scene import Place, Scene, check_scene
from solve.contact.unilateral import housing_travel
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import Footprint
from solve.fruit.split import SplitDomainError, check_domain
from solve.halfspace.punch import graded_edges

# Cells a side of the coarse and the fine grid; without mirror symmetry there are twice as many cells.
CELLS = {"mirrored": (18, 26), "rolled": (14, 20)}
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
    compliance does; cells of other tips get the change by the shape of the fruit alone.
    """

    cells: ContactCells
    edges: Floats
    gap: Floats
    middle: Floats
    compliance_correction: Floats


def scene_cells(
    scene: Scene, compliance: FruitCompliance, farthest: float, mirrored: bool | None = None
) -> tuple[SceneCells, SceneCells]:
    """Return a coarse and a fine grid of cells for travels up to `farthest` [mm]; `compliance` is that of flat tips.

    `mirrored` says whether cells at y > 0 stand for both sides, as they do for a mirrored scene if it is None. Raises
    InputError when the scene is too steep, or outside the domain of the split.
    """
    footprints = scene_footprints(scene, farthest)
    mirrored = scene.mirrored if mirrored is None else mirrored
    counts = CELLS["mirrored" if mirrored else "rolled"]
    grading = _grading(scene.tips.tip_shape)
    lines = tuple(tuple(graded_edges(count, grading).tolist()) for count in counts)
    grids = _grids(scene.fruit.equivalent_block, footprints, lines, mirrored)
    coarse, fine = (
        _gaps(scene, cells, footprints[0].side * np.array(edges), compliance)
        for cells, edges in zip(grids, lines, strict=True)
    )
    return coarse, fine


def _grading(shape: TipShape) -> float:
    """Return how much narrower cells become towards the edge of a face."""
    if not shape.has_flat_face:
        return NO_GRADING
    return CIRCLE_GRADING if shape.is_round else SQUARE_GRADING


def scene_footprints(scene: Scene, farthest: float) -> tuple[Footprint, ...]:
    """Return the squares that hold all that the tips may touch for travels up to `farthest` [mm]; solves nothing.

    Raises InputError when the scene is too steep, or outside the domain of the split.
    """
    check_scene(scene)
    footprints = _touched_footprints(scene, farthest)
    try:
        check_domain(scene.fruit.equivalent_block, footprints)
    except SplitDomainError as outside:
        reason = str(outside).partition(" for the split")[0]
        msg = f"{reason} for contact with tilt, curvature or fillet; change the scene, or make it flat and level"
        raise InputError(msg) from outside
    return footprints


def interference(scene: Scene, grid: SceneCells, x: float) -> Floats:
    """Return how far the undeformed tips would enter the fruit [mm] at travel x [mm], per cell; -inf without a face."""
    press = scene.press
    lowered = housing_travel(grid.cells, x, press.tilt_deg, press.roll_deg, grid.middle) - grid.gap
    return np.asarray(lowered + np.array(scene.ahead)[grid.cells.owner])


def posed(grid: SceneCells, built: Scene, scene: Scene) -> SceneCells:
    """Return the cells of the scene `built` with the gaps of another pose or radius of the fruit.

    The cells stay where they are on the block, so that one matrix serves poses near to each other.
    """
    return replace(grid, gap=_gap(scene, built, grid.cells))


def _gap(scene: Scene, built: Scene, cells: ContactCells) -> Floats:
    """Return the gap of cells that stand under the tips of the scene `built` [mm]."""
    centres = np.array(built.centres)
    moved = (np.array(scene.centres) - centres)[cells.owner]
    local = cells.places - centres[cells.owner]
    return scene.fruit_gap(*(cells.places + moved).T) + scene.tip_gap(*local.T) - scene.first_touch_mm


# One scene is pressed again and again, by its own springs, the paper's, and at full travel: its cells cost 2 s.
@functools.lru_cache(maxsize=4)
def _grids(
    block: Fruit, footprints: tuple[Footprint, ...], lines: tuple[tuple[float, ...], ...], mirrored: bool
) -> tuple[ContactCells, ...]:
    smooth = smooth_compliance(block, footprints)
    grids = (contact_cells(block, footprints, np.array(edges), smooth) for edges in lines)
    return tuple(folded(cells) if mirrored else cells for cells in grids)


def _gaps(scene: Scene, cells: ContactCells, edges: Floats, compliance: FruitCompliance) -> SceneCells:
    gap = _gap(scene, scene, cells)
    correction = compliance.shape_change
    if scene.tips.tip_shape.has_flat_face:
        faces = np.isfinite(gap)
        tips = cells.tips[faces]
        forces = np.linalg.solve(cells.compliance[np.ix_(faces, faces)], tips)
        correction = compliance.S - np.linalg.inv(tips.T @ forces)
    return SceneCells(cells, edges, gap, np.mean(scene.centres, axis=0), correction)


def _touched_footprints(scene: Scene, farthest: float) -> tuple[Footprint, ...]:
    """Return squares that hold every place where a tip may touch."""
    side, centres = scene.tips.side_mm, scene.centres
    if scene.tips.tip_shape.obeys_hertz:
        side, centres = _touched_squares(scene, farthest)
    elif not scene.tips.tip_shape.has_flat_face:
        side = _touched_side(scene, farthest)
    return tuple(Footprint(x, y, side) for x, y in centres)


def _entered(scene: Scene, farthest: float) -> list[tuple[Floats, Floats]]:
    """Return where each undeformed tip would be in the fruit: places from its centre [mm], x and y."""
    side = scene.tips.side_mm
    line = 0.5 * side * np.linspace(-1.0, 1.0, SAMPLES)
    x, y = np.meshgrid(line, line, indexing="ij")
    middle = np.mean(scene.centres, axis=0)
    places = []
    for centre in scene.centres:
        along, across = centre[0] - middle[0] + x, centre[1] - middle[1] + y
        lowered = farthest + along * scene.turn[0] + across * scene.turn[1]
        entered = lowered > scene.gap_under(centre, x, y) - scene.first_touch_mm
        places.append((x[entered], y[entered]))
    return places


def _touched_side(scene: Scene, farthest: float) -> float:
    """Return the side [mm] of a square about each tip that holds all it may touch."""
    side = scene.tips.side_mm
    places = _entered(scene, farthest)
    reach = max(float(np.maximum(np.abs(x), np.abs(y)).max(initial=0.0)) for x, y in places)
    step = side / (SAMPLES - 1)
    return min(side, MARGIN * 2.0 * (reach + step))


def _touched_squares(scene: Scene, farthest: float) -> tuple[float, tuple[Place, ...]]:
    """Return the side [mm] and the centres [mm] of squares that hold all that each dome may touch."""
    step = scene.tips.side_mm / (SAMPLES - 1)
    side, centres = step, []
    for (x, y), (along, across) in zip(_entered(scene, farthest), scene.centres, strict=True):
        middle = [0.5 * (axis.min() + axis.max()) if len(axis) else 0.0 for axis in (x, y)]
        side = max(side, *(float(np.ptp(axis)) if len(axis) else 0.0 for axis in (x, y)))
        centres.append((along + middle[0], across + middle[1]))
    return TOUCHED * (side + 2.0 * step), tuple(centres)
