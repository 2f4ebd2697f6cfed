"""Pressure on the footprints of the tips, given as the forces of the contact cells."""

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
    """Forces on square grids of cells under all tips at modulus E [MPa].

    The axes of `cell_forces` (tips, n, n) [N] are the tips, then along and across them. `edges` (n + 1,) [mm] are the
    grid lines from the centre of a tip. `centres` (tips, 2) [mm] are the centres of the tips from the apex.
    """

    E: float
    centres: Floats
    edges: Floats
    cell_forces: Floats

    @property
    def forces(self) -> Floats:
        """Return the forces of the tips [N], shape (tips,)."""
        return np.asarray(self.cell_forces.sum(axis=(1, 2)))


def footprint_pressure(scene: Scene, compliance: FruitCompliance, C: Floats, E: float, x: float) -> FootprintPressure:
    """Return the pressure at modulus E [MPa] and travel x [mm], on springs with compliance C (tips, tips) [mm/N].

    Raises InputError if the scene is too steep or outside the domain of contact, and SolveError if a solve fails.
    """
    if not E > 0.0:
        raise validation_error("E", E, "MPa", "greater than 0", "give a modulus of the fruit")
    _, grid = scene_cells(scene, compliance.at(E), x)  # the fine one
    interference = grid.interference(scene, x)
    # Contact is solved for forces over E [mm^2], so compliances are multiplied by E [1/mm].
    compliance_times_E = E * np.asarray(C, dtype=np.float64) + grid.compliance_correction
    contact = UnilateralContact(grid.cells).solve(interference, compliance_times_E)

    across = len(grid.edges) - 1
    forces = E * (contact.pressure * grid.cells.areas)  # [N]
    forces = forces.reshape(len(contact.F), across, -1)  # (tips, along, across)
    if grid.is_half:  # only y > 0 was solved, with doubled areas: the scene is symmetric about y = 0
        forces = 0.5 * np.concatenate([forces[..., ::-1], forces], axis=2)
    return FootprintPressure(E=E, centres=grid.cells.centres, edges=grid.edges, cell_forces=forces)
