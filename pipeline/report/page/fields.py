"""The fields that pictures of the page show: stress in the flexures, pressure under flat tips.

In a run they come from its result, later from the VTU files of a folder that was written with --fields.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

from cad.quantity import InputError
from mesh.housing.sweep import flexure_mesh
from pipeline.report.stored import StoredReport
from pipeline.response.scene_press import scene_of
from pipeline.result import SensorResult
from pipeline.springs.mounts import attached_to
from pipeline.storage.vtu import write_vtu
from solve.contact.pressure import footprint_pressure
from solve.housing.fields import flexure_fields

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STRESS, DISPLACEMENT, TENSOR = "von_mises_MPa", "displacement_mm", "stress_MPa"
_COARSE = 2.0  # mesh of the picture of a run: its stress is some per cent off, and a third of the time
_NEAR = 1e-6  # [mm]
_ZZ = 2  # of the components of a tensor
_FACES = (
    (0, 8, 1, 9, 2, 10, 3, 11),
    (4, 12, 5, 13, 6, 14, 7, 15),
    (0, 8, 1, 17, 5, 12, 4, 16),
    (1, 9, 2, 18, 6, 13, 5, 17),
    (2, 10, 3, 19, 7, 14, 6, 18),
    (3, 11, 0, 16, 4, 15, 7, 19),
)
"""The nodes of each face of VTK's 20-node hexahedron, corners and middles of edges in turn."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FlexureSection:
    """The middle plane of the loaded housing: places x, z [mm], how they move [mm], von Mises stress [MPa].

    `faces` (faces, 8) are the nodes of each face all around, corners and middles in turn.
    """

    places: Floats
    moves: Floats
    stress: Floats
    faces: Ints


@dataclass(frozen=True, kw_only=True, eq=False)
class TipPressure:
    """The pressure [MPa] along the middle line of a flat tip, over the places from its centre [mm]."""

    places: Floats
    pressure: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Fields:
    """What is known of the fields: the flexures, the pressure under each tip; None or none where it is not."""

    flexure: FlexureSection | None
    pressures: tuple[TipPressure, ...]


def fields_of_folder(report: StoredReport, folder: Path) -> Fields:
    """Return the fields that the VTU files of a folder hold [mm, MPa]."""
    path, fruit = folder / "flexure.vtu", folder / "fruit.vtu"
    return Fields(
        flexure=_section(path) if path.is_file() else None,
        pressures=_stored_pressures(report, fruit) if fruit.is_file() else (),
    )


def fields_of_result(result: SensorResult, report: StoredReport, folder: Path) -> Fields:
    """Return the fields of a run [mm, MPa], from its files where it wrote them; raises SolveError."""
    if result.options.fields:
        return fields_of_folder(report, folder)
    return Fields(flexure=_solved_section(result), pressures=_solved_pressures(result))


def _solved_section(result: SensorResult) -> FlexureSection | None:
    """Return the middle plane on a coarse mesh, under the forces at which the root strain is judged."""
    springs = result.springs
    if springs.housing is None:
        return None
    mesh, process = flexure_mesh(springs.housing, _COARSE), springs.process
    pairs = zip(springs.springs, springs.deflections, strict=True)
    forces = [spring.stiffness * deflection for spring, deflection in pairs]
    fields = flexure_fields(mesh, process.E_MPa, process.poisson, forces, attached_to(springs.housing))
    with tempfile.TemporaryDirectory(prefix="twintip-") as name:
        path = Path(name) / "flexure.vtu"
        write_vtu(path, mesh, {DISPLACEMENT: fields.displacement, STRESS: fields.von_mises})
        return _section(path)


def _section(path: Path) -> FlexureSection | None:
    """Return the faces at y = 0 of a file; None where it holds no stress."""
    grid = meshio.read(path)
    if not {STRESS, DISPLACEMENT} <= grid.point_data.keys():
        return None
    cells = np.concatenate([block.data for block in grid.cells])
    faces = np.concatenate([cells[:, list(face)] for face in _FACES])
    faces = faces[(np.abs(grid.points[faces, 1]) < _NEAR).all(axis=1)]
    nodes, local = np.unique(faces, return_inverse=True)
    in_plane = [0, 2]
    return FlexureSection(
        places=grid.points[nodes][:, in_plane],
        moves=np.asarray(grid.point_data[DISPLACEMENT], dtype=np.float64)[nodes][:, in_plane],
        stress=np.asarray(grid.point_data[STRESS], dtype=np.float64)[nodes],
        faces=local.reshape(faces.shape),
    )


def _solved_pressures(result: SensorResult) -> tuple[TipPressure, ...]:
    """Return the pressure under flat tips at the largest modulus and full travel; none where it is not solved."""
    design = result.design
    if design.tips.tip_shape.obeys_hertz:
        return ()
    scene, E = scene_of(design, result.press.ahead), float(result.press.hardest.E[-1])
    try:
        found = footprint_pressure(scene, result.contact, result.springs.C, E, design.press.travel_mm)
    except InputError:
        return ()
    sizes = np.diff(found.edges)
    middle = len(sizes) // 2
    rows = found.cell_forces[:, :, middle] / (sizes * sizes[middle])
    places = 0.5 * (found.edges[1:] + found.edges[:-1])
    return tuple(TipPressure(places=places, pressure=row) for row in rows)


def _stored_pressures(report: StoredReport, path: Path) -> tuple[TipPressure, ...]:
    """Return the pressure on the top of the fruit under each tip, from the nodes on the line through its centre."""
    grid = meshio.read(path)
    if TENSOR not in grid.point_data:
        return ()
    top = np.flatnonzero(grid.points[:, 2] > grid.points[:, 2].max() - _NEAR)
    places, pressure = grid.points[top], -np.asarray(grid.point_data[TENSOR], dtype=np.float64)[top, _ZZ]
    half = 0.5 * report.design.tips.side_mm
    return tuple(_along_tip(places - np.array([tip.x_mm, tip.y_mm, 0.0]), pressure, half) for tip in report.tips)


def _along_tip(away: Floats, pressure: Floats, half: float) -> TipPressure:
    """Return the pressure [MPa] at the places on the middle line of a tip, at most half its side away [mm]."""
    across = np.abs(away[:, 1])
    line = np.flatnonzero((across < across.min() + _NEAR) & (np.abs(away[:, 0]) <= half))
    line = line[np.argsort(away[line, 0])]
    return TipPressure(places=away[line, 0], pressure=np.maximum(pressure[line], 0.0))
