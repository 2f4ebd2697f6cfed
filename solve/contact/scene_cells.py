"""Contact cells on the footprints of a scene, with the initial gap between each cell and the fruit.

A footprint is the square on the fruit that contains the contact of one tip. For a curved fruit, the cells lie on the
block of the same plan and thickness. The curvature adds a gap under each tip, and a change in compliance that is
computed for a level press.
"""

import functools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Flags, Floats
from sensor.design.fruit import Fruit
from sensor.quantity import validation_error
from solve.contact.gap import tip_gap
from solve.contact.pressure_cells import FINE, ContactCells, contact_cells, half_cells
from solve.contact.scene import Point, Scene, check_scene
from solve.contact.unilateral import IndefiniteCellsError
from solve.fruit.box import Grading
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import Footprint
from solve.fruit.skin import layer_on, table_moduli
from solve.fruit.split import ROUGH, check_domain
from solve.halfspace.layered import Layer
from solve.halfspace.punch import graded_edges

# Numbers of cells per side of a footprint, on the coarse and on the fine grid.
HALF_CELLS = (18, 26)  # with mirror symmetry, where only half of the cells are solved
WHOLE_CELLS = (14, 20)  # without mirror symmetry
ROUGH_CELLS = (8, 12)  # with a rough compliance; error bars are 0.7 % instead of 0.2 %
# Exponents for the grading of the cells towards the edge of a flat face, where the pressure is singular. The edge of a
# square follows grid lines, whereas the edge of a circle crosses them.
SQUARE_GRADING = 2.5
CIRCLE_GRADING = 1.5
NO_GRADING = 1.0
SAMPLES = 201  # points per side of a tip at which the initial gap is sampled
MARGIN = 1.02  # ratio of the side of a footprint to the width that it must contain
# Ratio of the side of a dome's footprint to the width of its undeformed overlap with the fruit. The ratio for Hertz's
# contact is 0.707.
OVERLAP_FRACTION = 0.75
HALVINGS = 6  # number of bisections between the moduli of a skin that can be solved and one that cannot
# Safety factor on the bound for a skin. The bound is computed on rough cells, and is tighter on finer cells.
BOUND_MARGIN = 1.5


@dataclass(frozen=True, eq=False)
class SceneCells:
    """Cells on the footprints of a scene, with their initial gap and a correction of their compliance.

    `edges` [mm] are the grid lines relative to the centre of a footprint, the same along and across. `gap` (cells,)
    [mm] is the initial gap at first touch. It is infinite for a cell outside the face of its tip. `middle` (2,) [mm] is
    the mean of the tip centres. `compliance_correction` (tips, tips) [1/mm] is added to the compliance times E. For
    flat tips, it gives the cells the known compliance in a level press. For other tips, it is only the effect of the
    fruit's shape. If `is_half`, the cells lie at y > 0 and represent both sides.
    """

    cells: ContactCells
    edges: Floats
    gap: Floats
    middle: Floats
    compliance_correction: Floats
    is_half: bool

    def interference(self, scene: Scene, x: float) -> Floats:
        """Return the overlap of the undeformed tips with the undeformed fruit [mm] at travel x [mm], (cells,).

        It is -inf for a cell outside the face of its tip.
        """
        lowering = x
        if scene.from_touch:  # travel is measured from the first touch of the tilted sensor
            lowering = x - float(self._overlap(scene, scene.tilt_tangents_at_touch, 0.0).max())
        return self._overlap(scene, scene.tilt_tangents, lowering)

    def _overlap(self, scene: Scene, tilt_tangents: Floats, lowering: float) -> Floats:
        """Return the overlap (cells,) [mm] after the middle of the tips has moved down by `lowering` [mm].

        `tilt_tangents` (2,) [1] are the tangents of tilt and roll.
        """
        by_tilt = (self.cells.points - self.middle) @ tilt_tangents  # additional lowering of each cell
        height_offsets = np.array(scene.height_offsets_mm)[self.cells.owner]
        return np.asarray(lowering + by_tilt - self.gap + height_offsets)


@dataclass(frozen=True)
class _GridLayout:
    """The layout of a grid of cells: its grid lines from -1/2 to 1/2, and whether only half of the cells are solved.

    `mesh` is the mesh grading for the remainder.
    """

    edges: tuple[float, ...]
    is_half: bool
    mesh: Grading


def scene_cells(
    scene: Scene, compliance: FruitCompliance, largest_travel: float, is_half: bool | None = None
) -> tuple[SceneCells, SceneCells]:
    """Return a coarse and a fine grid of cells for travels up to `largest_travel` [mm].

    The two grids differ only in their number of cells, so that the caller can estimate the grid error. `compliance` is
    the compliance of the fruit under flat tips. With `is_half`, only cells at y > 0 are solved. By default, this is
    done if the scene is symmetric about y = 0. Raises InputError if a tip meets the fruit at more than 20 deg, or its
    footprint is too large or too near an edge (`check_domain`). Raises SolveError if a solve does not converge.
    """
    footprints = scene_footprints(scene, largest_travel)
    block = scene.fruit.equivalent_block
    # `flesh_E` is the modulus of the flesh under a skin; it is None for a fruit without a skin.
    layer = None if compliance.flesh_E is None else layer_on(scene.fruit, compliance.flesh_E)
    middle = np.mean(scene.centres, axis=0)
    solve_half = scene.is_symmetric if is_half is None else is_half
    grids = []
    for layout in _grid_layouts(scene, compliance, solve_half):
        cells = _cells(block, footprints, layer, layout)
        gap = initial_gap(scene, grid_scene=scene, cells=cells)
        grid = SceneCells(
            cells=cells,
            edges=footprints[0].side * np.array(layout.edges),  # all footprints have the same side
            gap=gap,
            middle=middle,
            compliance_correction=_compliance_correction(scene, compliance, cells, gap),
            is_half=layout.is_half,
        )
        grids.append(grid)
    coarse_grid, fine_grid = grids
    return coarse_grid, fine_grid


def _grid_layouts(scene: Scene, compliance: FruitCompliance, is_half: bool) -> list[_GridLayout]:
    """Return the layouts of the coarse and the fine grid of cells, in this order. All tips share these layouts.

    With `is_half`, only the cells at y > 0 are solved. Half as many unknowns allow more cells per side. A rough
    compliance does not justify a fine grid, so it uses fewer cells in both cases.
    """
    shape = scene.tips.tip_shape
    grading_of_flat_face = CIRCLE_GRADING if shape.is_round else SQUARE_GRADING
    # The pressure of a curved tip falls to zero at the edge of its contact, and needs no grading.
    grading = grading_of_flat_face if shape.has_flat_face else NO_GRADING
    if compliance.rough:
        counts = ROUGH_CELLS
        mesh = ROUGH
    else:
        counts = HALF_CELLS if is_half else WHOLE_CELLS
        mesh = FINE
    layouts = []
    for count in counts:
        edges = tuple(graded_edges(count, grading).tolist())
        layouts.append(_GridLayout(edges=edges, is_half=is_half, mesh=mesh))
    return layouts


def _compliance_correction(scene: Scene, compliance: FruitCompliance, cells: ContactCells, gap: Floats) -> Floats:
    """Return the correction that is added to the compliance of cells times E [1/mm], shape (tips, tips).

    `compliance` is the compliance of the fruit under flat tips. `gap` (cells,) [mm] is the initial gap, infinite
    outside the faces of the tips.
    """
    if scene.tips.tip_shape.has_flat_face:
        # The given compliance is for full contact of these faces, so the correction also removes the grid error.
        return compliance.S - _level_compliance(cells, np.isfinite(gap))
    return compliance.shape_change


def _level_compliance(cells: ContactCells, faces: Flags) -> Floats:
    """Return the compliance of level tips on these cells, times E [1/mm], if all cells in `faces` (cells,) touch."""
    tips = cells.tips[faces]
    # The columns are the forces of the cells for a unit travel of one tip. Their sums over the cells of each tip are
    # the stiffness matrix of the tips.
    forces = np.linalg.solve(cells.compliance[np.ix_(faces, faces)], tips)
    return np.linalg.inv(tips.T @ forces)


@contextmanager
def explain_skin_error(scene: Scene, compliance: FruitCompliance) -> Iterator[None]:
    """Convert an IndefiniteCellsError into an InputError if the modulus of the skin is its cause.

    Use it as a context manager around a contact solve. The InputError states a bound on the modulus of the skin. The
    model places the skin under each tip on a half-space. It fails for a very stiff or a very soft skin, where the
    compliance of the cells is no longer positive definite.
    """
    try:
        yield
    except IndefiniteCellsError as error:
        if compliance.flesh_E is None:
            raise
        bound = _skin_bound(scene, compliance.flesh_E)
        if bound is None:
            raise
        hint = "choose another modulus for the skin or a larger fruit, or leave the skin out"
        raise validation_error("fruit.skin_E_MPa", scene.fruit.skin_E_MPa, "MPa", bound, hint) from error


def _skin_bound(scene: Scene, E: float) -> str | None:
    """Return a text with the bound on the modulus of a skin that cannot be solved on flesh of modulus E [MPa].

    The bound is found by bisection between this skin and a skin that has the shear modulus of the flesh. If the second
    skin cannot be solved either, the modulus is not the cause of the failure, and the result is None.
    """
    fruit = scene.fruit
    layer = layer_on(fruit, E)
    footprints = scene_footprints(scene, scene.press.travel_mm)
    edges = graded_edges(ROUGH_CELLS[0], SQUARE_GRADING)  # few cells, because each trial assembles a new matrix

    def is_solvable(modulus_ratio: float) -> bool:
        """Return whether the compliance of the cells under a skin with this modulus is positive definite."""
        cells = contact_cells(fruit.equivalent_block, footprints, edges, replace(layer, modulus=modulus_ratio), ROUGH)
        smallest_eigenvalue = np.linalg.eigvalsh(cells.compliance)[0]
        return bool(smallest_eigenvalue > 0.0)

    # All ratios are the modulus of the skin divided by the modulus of the flesh. Two materials with the same shear
    # modulus E / (2 (1 + nu)) have moduli in the ratio of their 1 + nu.
    equal_shear_ratio = (1.0 + layer.poisson) / (1.0 + layer.poisson_below)
    if not is_solvable(equal_shear_ratio):
        return None
    solvable_ratio, unsolvable_ratio = _bisect_ratio(is_solvable, equal_shear_ratio, layer.modulus)
    # An upper bound is strictest on the softest flesh of the fruit, and a lower bound on the stiffest.
    softest, *_, stiffest = table_moduli(fruit)
    if unsolvable_ratio > solvable_ratio:
        largest = solvable_ratio / BOUND_MARGIN * softest
        return f"at most {largest:.2g} MPa on flesh of {softest:.3g} MPa under these tips"
    smallest = solvable_ratio * BOUND_MARGIN * stiffest
    return f"at least {smallest:.2g} MPa on flesh of {stiffest:.3g} MPa under these tips"


def _bisect_ratio(
    is_solvable: Callable[[float], bool], solvable_ratio: float, unsolvable_ratio: float
) -> tuple[float, float]:
    """Return a solvable and an unsolvable ratio of moduli [1] that are closer together, after HALVINGS bisections.

    The given ratios can differ by orders of magnitude, so the interval is halved on a logarithmic scale.
    """
    for _ in range(HALVINGS):
        middle_ratio = (solvable_ratio * unsolvable_ratio) ** 0.5
        if is_solvable(middle_ratio):
            solvable_ratio = middle_ratio
        else:
            unsolvable_ratio = middle_ratio
    return solvable_ratio, unsolvable_ratio


def scene_footprints(scene: Scene, largest_travel: float) -> tuple[Footprint, ...]:
    """Return square footprints that contain the contact of each tip at all travels up to `largest_travel` [mm].

    The footprints follow from the geometry only, before any contact is solved. Raises InputError if a tip meets the
    fruit at more than 20 deg, or its footprint is too large or too near an edge (`check_domain`).
    """
    check_scene(scene)
    centres: Sequence[Point]
    if scene.tips.tip_shape.has_flat_face:  # the contact can cover the entire face
        side = scene.tips.side_mm
        centres = scene.centres
    else:
        side, centres = _contact_squares(scene, largest_travel)
    footprints = tuple(Footprint(x, y, side) for x, y in centres)
    check_domain(scene.fruit.equivalent_block, footprints)
    return footprints


def initial_gap(scene: Scene, grid_scene: Scene, cells: ContactCells) -> Floats:
    """Return the initial gap of each cell at first touch (cells,) [mm], for the tip positions of `scene`.

    The cells lie under the tips of `grid_scene`, the scene for which they were made. Its tips may have other positions
    on the fruit. The cells then keep their places under the tips, and only the gap to the fruit changes.
    """
    grid_centres = np.array(grid_scene.centres)
    shift = (np.array(scene.centres) - grid_centres)[cells.owner]
    from_tip_centre = cells.points - grid_centres[cells.owner]
    fruit_part = scene.fruit_gap(*(cells.points + shift).T)
    return fruit_part + tip_gap(scene.tips.tip_shape, *from_tip_centre.T) - scene.first_touch_mm


# A run presses a scene on its own springs, on the paper's springs, and at full travel. The cells are cached, because
# their compliance takes 2 s to compute.
@functools.lru_cache(maxsize=8)
def _cells(block: Fruit, footprints: tuple[Footprint, ...], layer: Layer | None, grid: _GridLayout) -> ContactCells:
    """Return the cells of one grid on footprints of a block, with an optional layer of skin.

    Raises SolveError if the solve for the remainder does not converge.
    """
    cells = contact_cells(block, footprints, np.array(grid.edges), layer, grid.mesh)
    return half_cells(cells) if grid.is_half else cells


def _contact_squares(scene: Scene, largest_travel: float) -> tuple[float, list[Point]]:
    """Return the side [mm] and the centres [mm] of squares that contain the contact of each curved tip.

    The contact is smaller than the overlap between the undeformed tip and the undeformed fruit at the largest travel
    [mm]. All squares have the same side, because all tips share one layout of cells. The squares of domes are centred
    on these overlaps, and other squares on the tips.
    """
    side = scene.tips.side_mm
    # The spacing of the points at which the overlap is sampled. An overlap may extend beyond its outermost samples, by
    # less than this step on each side.
    step = side / (SAMPLES - 1)
    overlap_of_tips = [_overlap_bounds(scene, centre, largest_travel) for centre in scene.centres]
    overlaps = [overlap for overlap in overlap_of_tips if overlap is not None]

    if scene.tips.tip_shape.touches_beside_centre:  # domes
        # The largest width of an overlap along x or y. A tip that does not touch still needs a square.
        width = max([step, *(float((high - low).max()) for low, high in overlaps)])
        centres = list(map(_overlap_centre, scene.centres, overlap_of_tips))
        return OVERLAP_FRACTION * (width + 2.0 * step), centres
    # The largest distance along x or y from the centre of a tip to the edge of its overlap.
    reach = max([0.0, *(float(np.abs(overlap).max()) for overlap in overlaps)])
    return min(side, MARGIN * 2.0 * (reach + step)), list(scene.centres)


def _overlap_centre(centre: Point, overlap: tuple[Floats, Floats] | None) -> Point:
    """Return the centre x, y [mm] of the overlap of a tip with the fruit, or the centre of the tip without overlap.

    `centre` [mm] is the centre of the tip, and `overlap` is the result of `_overlap_bounds` for this tip.
    """
    if overlap is None:
        return centre
    low, high = overlap
    offset = 0.5 * (low + high)
    return centre[0] + float(offset[0]), centre[1] + float(offset[1])


def _overlap_bounds(scene: Scene, centre: Point, largest_travel: float) -> tuple[Floats, Floats] | None:
    """Return the smallest and the largest x, y [mm] at which a tip overlaps the fruit, or None if it does not.

    Both are arrays (2,), and x and y are relative to `centre` [mm], the centre of the tip. Tip and fruit are
    undeformed. The travel of the sensor is `largest_travel` [mm]. The overlap is sampled on a square grid of points
    over the face of the tip.
    """
    offsets = 0.5 * scene.tips.side_mm * np.linspace(-1.0, 1.0, SAMPLES)
    x, y = np.meshgrid(offsets, offsets, indexing="ij")
    centre_x, centre_y = centre
    middle = np.mean(scene.centres, axis=0)
    # The tilted sensor rotates about the middle of the tips, so the travel of a point depends on its position.
    tilt, roll = scene.tilt_tangents
    travel = largest_travel + (centre_x - middle[0] + x) * tilt + (centre_y - middle[1] + y) * roll
    overlaps = travel > scene.gap_under(centre, x, y) - scene.first_touch_mm
    if not overlaps.any():
        return None
    low = np.array([x[overlaps].min(), y[overlaps].min()])
    high = np.array([x[overlaps].max(), y[overlaps].max()])
    return low, high
