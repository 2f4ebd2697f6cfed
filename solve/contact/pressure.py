"""The pressure under each tip, as the forces on a grid of contact cells."""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats
from sensor.quantity import validation_error
from solve.contact.scene import Scene
from solve.contact.scene_cells import scene_cells
from solve.contact.unilateral import UnilateralContact
from solve.fruit.compliance import FruitCompliance


@dataclass(frozen=True, kw_only=True, eq=False)
class FootprintPressure:
    """The forces on the cells of a square grid under each tip, at the modulus E [MPa].

    `cell_forces` has shape (tips, n, n) [N]; its last two axes are the directions along the tips and across. `edges` (n
    + 1,) [mm] are the grid lines relative to the centre of a tip. `centres` (tips, 2) [mm] are the centres relative to
    the apex.
    """

    E: float
    centres: Floats
    edges: Floats
    cell_forces: Floats

    @property
    def forces(self) -> Floats:
        """Return the force on each tip [N], shape (tips,)."""
        return np.asarray(self.cell_forces.sum(axis=(1, 2)))


def footprint_pressure(scene: Scene, compliance: FruitCompliance, C: Floats, E: float, x: float) -> FootprintPressure:
    """Return the pressure under all tips at the modulus E [MPa] and the travel x [mm].

    The contact is solved on the finer of the two grids of cells of a scene. `compliance` is the compliance of the
    fruit, and C (tips, tips) [mm/N] is the compliance of the springs. Raises InputError if E is not above 0, or a tip
    meets the fruit at more than 20 deg. Also raises InputError if the scene is outside the domain of the contact
    solver, and SolveError if a solve does not converge.
    """
    if not E > 0.0:
        raise validation_error("E", E, "MPa", "greater than 0", "give a modulus of the fruit")
    _, grid = scene_cells(scene, compliance.at(E), x)  # the fine grid
    interference = grid.interference(scene, x)
    # Contact is solved for forces divided by E [mm^2], so compliances are multiplied by E [1/mm].
    compliance_times_E = E * np.asarray(C, dtype=np.float64) + grid.compliance_correction
    contact = UnilateralContact(grid.cells).solve(interference, compliance_times_E)

    per_side = len(grid.edges) - 1
    cell_forces = E * (contact.pressure * grid.cells.areas)  # [N]
    cell_forces = cell_forces.reshape(len(contact.F), per_side, -1)  # (tips, along, across)
    if grid.is_half:
        # Only the cells at y > 0 were solved, and each carries the force of both sides. Half of it is moved to the
        # mirror image at y < 0, which comes first along the last axis.
        cell_forces = 0.5 * np.concatenate([cell_forces[..., ::-1], cell_forces], axis=2)
    return FootprintPressure(E=E, centres=grid.cells.centres, edges=grid.edges, cell_forces=cell_forces)
