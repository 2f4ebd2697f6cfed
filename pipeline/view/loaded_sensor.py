"""The sensor under any press: fields of housing and fruit at a modulus and a travel, for sliders and for a series.

The housing is linear: its fields are those of 1 N on each tip, times the forces of the stored response. The fruit's are
solved again from the pressure under the tips.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from cad.design.processes import Process
from cad.parts.housing import Housing
from cad.quantity import validation_error
from mesh.housing.sweep import flexure_mesh
from pipeline.report.fields import field_arrays
from pipeline.report.stored import StoredReport, StoredResponse
from pipeline.response.scene_press import scene_of
from pipeline.springs.mounts import attached_to
from pipeline.storage.vtu import Mesh as SolvedMesh
from pipeline.storage.vtu import write_vtu
from solve.contact.fields import fruit_fields
from solve.contact.pressure import footprint_pressure
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.housing.fields import fields_of
from solve.housing.stiffness import displacements
from solve.nodal_fields import NodalFields

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes
Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadedHousing:
    """The half housing y >= 0 [mm] and its fields under 1 N on the low and on the high tip."""

    mesh: SolvedMesh
    unit: tuple[NodalFields, ...]

    def under(self, forces: Sequence[float]) -> dict[str, Floats]:
        """Return the arrays of a VTU file under forces on the tips [N], the low one's first."""
        pairs = list(zip(forces, self.unit, strict=True))
        fields = NodalFields(
            displacement=np.sum([force * one.displacement for force, one in pairs], axis=0),
            stress=np.sum([force * one.stress for force, one in pairs], axis=0),
            strain=np.sum([force * one.strain for force, one in pairs], axis=0),
        )
        return field_arrays(fields)


def loaded_housing(housing: Housing, process: Process) -> LoadedHousing:
    """Return the fields of a housing [mm] of a process's material for 1 N on each tip; raises SolveError."""
    mesh, E, poisson = flexure_mesh(housing), process.E_MPa, process.poisson
    u = displacements(mesh, E, poisson, attached_to(housing))
    return LoadedHousing(mesh=mesh, unit=tuple(fields_of(mesh, E, poisson, column) for column in u.T))


def housing_of(report: StoredReport, folder: Path) -> LoadedHousing:
    """Return the housing of a folder's report with its unit loads; raises InputError where it has none, SolveError."""
    if report.housing is None:
        raise validation_error(
            "DIR", str(folder), "", "an output folder with a housing", "run a design that can be made"
        )
    return loaded_housing(report.housing, report.design.process)


def fruit_under(report: StoredReport, folder: Path, E: float, x: float) -> tuple[SolvedMesh, dict[str, Floats]]:
    """Return the mesh of the fruit's block [mm] and the arrays of a VTU file at modulus E [MPa] and travel x [mm].

    The sensor is level but for the tilt of the design. Raises InputError where the scene cannot be drawn, SolveError.
    """
    S = np.array(report.contact.compliance_per_mm)
    info = SolveInfo(method="stored", dofs=0, seconds=0.0, status="read from report.json")
    contact = FruitCompliance(
        S=S,
        tips=tuple(tip.name for tip in report.tips),
        error_pair=0.01 * report.contact.error_percent,
        error_own=0.01 * report.contact.s11_error_percent,
        info=info,
    )
    pressure = footprint_pressure(scene_of(report.design), contact, _spring_compliance(report, folder), E, x)
    mesh, fields = fruit_fields(report.design.fruit, pressure)
    return mesh, field_arrays(fields)


def _spring_compliance(report: StoredReport, folder: Path) -> Floats:
    """Return the compliance of the springs under all tips [mm/N]; what one moves another is below their errors."""
    stiffness = {name: spring.stiffness_N_per_m for name, spring in report.springs.items()}
    own = [stiffness.get(tip.spring) for tip in report.tips]
    if None in own:
        raise validation_error(
            "DIR", str(folder), "", "an output folder with springs that are made", "run one that can be made"
        )
    return np.diag([1e3 / (K or 1.0) for K in own])


def forces_at(response: Sequence[StoredResponse], E: float, x: float) -> tuple[float, ...]:
    """Return the force of a tip on each spring [N], the low one's first, at modulus E [MPa] and travel x [mm].

    Between the travels of a stored response a force is taken as a straight line, from 0 at the first touch; between
    its moduli the give x / F as one over 1 / E, which it is where the scene is linear and its tips do not disturb each
    other. Outside the moduli the nearest counts.
    """
    rows = sorted(response, key=lambda row: row.E_MPa)
    softness = [1.0 / row.E_MPa for row in reversed(rows)]
    travels = [row.x_mm for row in reversed(rows)]
    tables = zip(*(row.kind_forces for row in reversed(rows)), strict=True)
    return tuple(_force(softness, travels, table, 1.0 / E, x) for table in tables)


def _force(
    softness: Sequence[float],
    travels: Sequence[Sequence[float]],
    table: Sequence[Sequence[float]],
    wanted: float,
    x: float,
) -> float:
    """Return the force [N] at 1 / E [1/MPa] and travel [mm] from a table of forces over travels for each 1 / E."""
    pairs = zip(travels, table, strict=True)
    forces = np.array([np.interp(x, [0.0, *row], [0.0, *values]) for row, values in pairs])
    if forces.min() <= 0.0 or x <= 0.0:
        return float(np.interp(wanted, softness, forces))
    return x / float(np.interp(wanted, softness, x / forces))


def as_drawn(mesh: SolvedMesh, arrays: dict[str, Floats]) -> Mesh:
    """Return a solved mesh with arrays as PyVista reads its VTU file: the very numbers that a file would hold."""
    with tempfile.TemporaryDirectory(prefix="twintip-") as folder:
        path = Path(folder) / "fields.vtu"
        write_vtu(path, mesh, arrays)
        return pv.read(path)
