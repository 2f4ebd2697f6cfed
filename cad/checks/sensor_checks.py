"""Geometry verdicts: on any solid, and on a sensor together with the files written from it."""

from collections.abc import Callable, Iterable
from pathlib import Path

import cadquery as cq
import trimesh
from OCP.BRepCheck import BRepCheck_Analyzer

from cad.checks.clearance import clearance_findings, stop_findings
from cad.checks.fillets import fillet_finding
from cad.checks.leaves import leaf_findings
from cad.checks.line_probe import Lines, MeshLines, SolidLines
from cad.checks.overhang import POSES
from cad.checks.slicer import slicer_findings
from cad.checks.triangle_checks import body_finding, closed_findings, crossing_finding, print_findings, size_findings
from cad.design.processes import PROCESSES, Process
from cad.files.sensor_files import sensor_pose
from cad.files.step import read_step
from cad.files.stl import read_stl, triangles
from cad.files.threemf import read_3mf
from cad.parts.pin_socket import socket_findings
from cad.parts.sensor import Sensor
from cad.parts.tips import tip_finding
from cad.quantity import fault
from cad.verdict import Verdict, equal, failed

DEFAULT_PROCESS = PROCESSES["fdm-petg"]
ROUND_TRIP_TOLERANCE = 1e-9  # Part 21 carries 15 digits


def check_solid(shape: cq.Shape) -> tuple[Verdict, ...]:
    """Return geometry.valid (count of faulty faces, edges, vertices) and geometry.one_solid (count of solids)."""
    analyser = BRepCheck_Analyzer(shape.wrapped)
    whole = bool(analyser.IsValid())
    pieces = [*shape.Faces(), *shape.Edges(), *shape.Vertices()]
    faulty = 0 if whole else max(1, sum(not analyser.IsValid(piece.wrapped) for piece in pieces))
    solids = shape.Solids()
    return (
        equal("geometry.valid", float(faulty), 0.0, 0.0, unit="1", reference="faulty faces, edges, vertices by OCCT"),
        equal("geometry.one_solid", float(len(solids)), 1.0, 0.0, unit="1", reference="number of solids"),
    )


def check_mesh(mesh: trimesh.Trimesh, process: Process, poses: Iterable[str]) -> tuple[Verdict, ...]:
    """Return every verdict on triangles [mm]: closed, one body, simple, size, wall, gap, overhang.

    Only what still has a meaning is measured on a mesh that is not closed.
    """
    closed = closed_findings(mesh)
    found = (*closed, body_finding(mesh), crossing_finding(mesh), *size_findings(mesh, process))
    if any(finding.passed is not True for finding in closed):
        return found
    return (*found, *print_findings(mesh, process, poses))


def check_file(path: Path, process: Process = DEFAULT_PROCESS) -> tuple[Verdict, ...]:
    """Return every verdict on a STEP, STL or 3MF file of any origin, for a process.

    An STL or a 3MF is taken in print pose, a STEP in the best of six poses. Raises OSError for a missing file,
    InputError for another kind of file; a file that cannot be read fails geometry.readable.
    """
    kind = path.suffix.lower()
    if kind not in _READERS:
        raise fault("PATH", path.name, "", f"a file of kind {', '.join(_READERS)}", "export the part as one of these")
    try:
        return (*_READERS[kind](_existing(path), process), *slicer_findings(path))
    except ValueError as error:
        return (_unreadable(error),)


def _existing(path: Path) -> Path:
    if not path.is_file():
        msg = f"{path.name}: there is no such file; check the path"
        raise FileNotFoundError(msg)
    return path


def _unreadable(error: ValueError) -> Verdict:
    return failed("geometry.readable", "a readable file", unit="1", reference=str(error))


def _check_step(path: Path, process: Process) -> tuple[Verdict, ...]:
    shape = read_step(path)
    solid = check_solid(shape)
    mesh = [each for each in check_mesh(triangles(shape), process, POSES) if each.name != "geometry.one_solid"]
    return (*solid, *mesh)


def _check_stl(path: Path, process: Process) -> tuple[Verdict, ...]:
    return check_mesh(read_stl(path), process, _AS_IT_STANDS)


def _check_3mf(path: Path, process: Process) -> tuple[Verdict, ...]:
    package = read_3mf(path)
    strict = f"warnings of lib3mf in strict mode; objects {', '.join(map(repr, package.names))}"
    strict += "".join(f"; {warning}" for warning in package.warnings)
    count = float(len(package.warnings))
    return (
        equal("geometry.3mf_strict", count, 0.0, 0.0, unit="1", reference=strict),
        *check_mesh(package.mesh, process, _AS_IT_STANDS),
    )


_AS_IT_STANDS = ("as it stands",)
_READERS: dict[str, Callable[[Path, Process], tuple[Verdict, ...]]] = {
    ".step": _check_step, ".stp": _check_step, ".stl": _check_stl, ".3mf": _check_3mf,
}  # fmt: skip


def check_sensor(sensor: Sensor, deflections: tuple[float, float], folder: Path) -> tuple[Verdict, ...]:
    """Return every geometry verdict on a sensor and on housing.step and housing.stl in a folder.

    The deflections [mm] of low and high spring are those at full travel. Raises FileNotFoundError; a file that
    cannot be read fails geometry.readable.
    """
    shape = sensor.part.shape
    step_path, stl_path = (_existing(folder / name) for name in ("housing.step", "housing.stl"))
    try:
        step, stl = read_step(step_path), sensor_pose(read_stl(stl_path), sensor.housing.depth)
    except ValueError as error:
        return (*check_solid(shape), _unreadable(error))
    forms: dict[str, Lines] = {"solid": SolidLines(shape), "STEP": SolidLines(step), "STL": MeshLines(stl)}
    return (
        *check_solid(shape),
        *closed_findings(stl),
        _round_trip(shape, step),
        *leaf_findings(sensor.housing, forms),
        fillet_finding(sensor.housing, forms),
        tip_finding(sensor.part, sensor.housing),
        *socket_findings(sensor.part, sensor.housing, sensor.tips),
        *clearance_findings(sensor),
        *stop_findings(sensor, deflections),
    )


def _round_trip(shape: cq.Shape, step: cq.Shape) -> Verdict:
    """Return geometry.step_round_trip: relative change of the volume from the solid to the file read back."""
    change = step.Volume() / shape.Volume() - 1.0
    reference = f"volume of housing.step against the solid, {shape.Volume():.6f} mm^3"
    return equal("geometry.step_round_trip", change, 0.0, ROUND_TRIP_TOLERANCE, unit="1", reference=reference)
