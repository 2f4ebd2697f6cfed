"""Pressure on the footprints of the tips: where it acts, its mean and its largest mean over a patch.

Under a flat face the pressure is infinite at the sharp edge, so the largest value of a grid would only measure the
grid; the mean over a patch of given size has a limit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.quantity import fault
from solve.contact.scene import Cells, Scene, approach, scene_cells
from solve.contact.unilateral import UnilateralContact
from solve.fruit.compliance import Compliance

Floats = NDArray[np.float64]

PATCH = 0.25  # of the side of a tip: the width of the square over which a largest pressure is averaged
PLACES = 61


@dataclass(frozen=True, kw_only=True)
class FootprintPressure:
    """Pressure on square grids of cells under both tips at modulus E [MPa] and travel x [mm], low tip first.

    `pressure` (2, n, n) [MPa], along the tips then across; `edges` (n + 1,) [mm] are the lines of cells from the
    centre of a tip, `centres` (2,) [mm] those of the tips from the apex. `forces` (2,) [N] and `indentations` (2,)
    [mm] of the tips; `outline` is the true area of a round face over that of its cells; `patch` [mm] is the width of
    the square of `largest_MPa`.
    """

    E: float
    x: float
    centres: Floats
    edges: Floats
    pressure: Floats
    forces: Floats
    indentations: Floats
    outline: float
    patch: float

    @property
    def areas(self) -> Floats:
        """Return the areas of the cells under one tip [mm^2], shape (n, n)."""
        width = np.diff(self.edges)
        found: Floats = self.outline * np.multiply.outer(width, width)
        return found

    @property
    def cell_forces(self) -> Floats:
        """Return the forces of the cells [N], shape (2, n, n)."""
        return self.pressure * self.areas

    @property
    def touching_mm2(self) -> Floats:
        """Return the area of contact under each tip [mm^2], shape (2,)."""
        return self.area_above(0.0)

    @property
    def mean_MPa(self) -> Floats:
        """Return force over touching area of each tip [MPa], shape (2,); 0 where a tip is off."""
        area = self.touching_mm2
        return np.divide(self.forces, area, out=np.zeros(2), where=area > 0.0)

    @property
    def largest_MPa(self) -> Floats:
        """Return the largest mean pressure of each tip over a square patch that lies on its footprint [MPa]."""
        half = 0.5 * self.patch
        centre = np.linspace(self.edges[0] + half, self.edges[-1] - half, PLACES)[:, None]
        low, high = np.maximum(self.edges[:-1], centre - half), np.minimum(self.edges[1:], centre + half)
        covered = np.maximum(high - low, 0.0) / np.diff(self.edges)
        found: Floats = (covered @ self.cell_forces @ covered.T).max(axis=(1, 2)) / self.patch**2
        return found

    def area_above(self, limit_MPa: float) -> Floats:
        """Return the area of each tip whose pressure exceeds a limit [mm^2], to a few per cent, shape (2,)."""
        found: Floats = ((self.pressure > limit_MPa) * self.areas).sum(axis=(1, 2))
        return found


def footprint_pressure(scene: Scene, compliance: Compliance, C: Floats, E: float, x: float) -> FootprintPressure:
    """Return the pressure at modulus E [MPa] and travel x [mm]; C (2, 2) [mm/N] is the compliance of the springs.

    Raises InputError where the scene is too steep or outside the domain of contact, SolveError when a solve fails.
    """
    if not E > 0.0:
        raise fault("E", E, "MPa", "greater than 0", "give a modulus of the fruit")
    C = np.asarray(C, dtype=np.float64)
    _, fine = scene_cells(scene, np.array(compliance.S), x)
    touch = UnilateralContact(fine.footprints).press(approach(scene, fine, x), E * C + fine.missing)
    count = len(fine.edges) - 1
    pressure = E * touch.pressure.reshape(2, count, -1)
    if pressure.shape[2] < count:
        pressure = np.concatenate([pressure[..., ::-1], pressure], axis=2)
    forces = E * touch.F
    outline = _outline(scene, fine)
    return FootprintPressure(
        E=E,
        x=x,
        centres=np.array(scene.centres),
        edges=fine.edges,
        pressure=pressure / outline,
        forces=forces,
        indentations=x - C @ forces,
        outline=outline,
        patch=min(PATCH * scene.tips.side_mm, float(fine.edges[-1] - fine.edges[0])),
    )


def _outline(scene: Scene, cells: Cells) -> float:
    """Return the true area of a face over that of its cells, whose outline is a staircase under a cylinder."""
    if scene.tips.shape != "cylinder":
        return 1.0
    faces = np.isfinite(cells.gap)
    drawn = float(cells.footprints.areas[faces].sum()) / len(cells.footprints.centres)
    return 0.25 * np.pi * scene.tips.side_mm**2 / drawn
