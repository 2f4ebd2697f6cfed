"""Verdicts on a single part of any origin: a solid, a triangle mesh, or a STEP, STL or 3MF file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import cadquery as cq
import OCP
import trimesh

from cad.checks.triangle_checks import (
    AS_IT_STANDS,
    POSES,
    body_verdict,
    closed_verdicts,
    drop_collapsed_triangles,
    printability_verdicts,
    size_verdicts,
)
from cad.files.step import read_step
from cad.files.stl import read_stl, triangles
from cad.files.threemf import read_3mf
from sensor.design.processes import PROCESSES, Process
from sensor.quantity import validation_error
from sensor.verdict import READABLE, Verdict, judge

DEFAULT_PROCESS = PROCESSES["fdm-petg"]
KINDS = (".step", ".stp", ".stl", ".3mf")


def check_solid(shape: cq.Shape) -> tuple[Verdict, ...]:
    """Return the verdicts geometry.valid and geometry.one_solid for a shape.

    The value of geometry.valid is the number of faulty faces, edges and vertices. The value of geometry.one_solid is
    the number of solids. Its reference text mentions faces that belong to no solid.
    """
    analyser = OCP.BRepCheck.BRepCheck_Analyzer(shape.wrapped)
    fault_count = 0
    if not analyser.IsValid():
        entities = [*shape.Faces(), *shape.Edges(), *shape.Vertices()]
        # The count is at least 1, because the fault may be in an entity of another type, such as a wire.
        fault_count = max(1, sum(not analyser.IsValid(entity.wrapped) for entity in entities))
    solid_count = len(shape.Solids())
    face_count = sum(len(solid.Faces()) for solid in shape.Solids())
    solid_text = "number of solids"
    if face_count != len(shape.Faces()):
        solid_text += "; some faces belong to none"
    return (
        judge("geometry.valid", fault_count, "faulty faces, edges, vertices by OCCT"),
        judge("geometry.one_solid", solid_count, solid_text),
    )


def check_mesh(mesh: trimesh.Trimesh, process: Process, poses: Iterable[str]) -> tuple[Verdict, ...]:
    """Return every verdict on a triangle mesh [mm]: closed surface, number of bodies, size, wall, gap and overhang.

    `process` is the print process, which sets the limits, and `poses` are the names in `POSES` of the print poses to
    consider. Wall, gap and overhang are omitted if the mesh is not closed, because it then has no interior.
    """
    cleaned = drop_collapsed_triangles(mesh)
    closed_surface = closed_verdicts(cleaned)
    verdicts = (*closed_surface, body_verdict(cleaned), *size_verdicts(cleaned, process))
    if any(verdict.passed is not True for verdict in closed_surface):
        return verdicts
    return (*verdicts, *printability_verdicts(cleaned, process, poses))


def check_file(path: Path, process: Process = DEFAULT_PROCESS) -> tuple[Verdict, ...]:
    """Return every verdict on a STEP, STL or 3MF file of any origin, with the limits of a print process.

    An STL or 3MF file is assumed to be in its print pose; a STEP file is checked in the best of six poses. A file that
    cannot be read fails geometry.readable. Raises FileNotFoundError if there is no file, and InputError if the file is
    of another kind.
    """
    kind = path.suffix.lower()
    if kind not in KINDS:
        bound = f"a file with the suffix {', '.join(KINDS)}"
        raise validation_error("PATH", path.name, "", bound, "export the part in one of these formats")
    require_file(path)
    try:
        if kind == ".stl":
            return check_mesh(read_stl(path), process, [AS_IT_STANDS])
        if kind == ".3mf":
            return _check_3mf(path, process)
        return _check_step(path, process)
    except ValueError as error:
        return (judge(READABLE, None, str(error)),)


def require_file(path: Path) -> Path:
    """Return the path unchanged. Raises FileNotFoundError if there is no file at the path."""
    if not path.is_file():
        msg = f"{path.name}: there is no such file; check the path"
        raise FileNotFoundError(msg)
    return path


def _check_step(path: Path, process: Process) -> tuple[Verdict, ...]:
    """Return the verdicts on the solid of a STEP file and on its triangles. Raises ValueError if it has no face."""
    shape = read_step(path)
    if not shape.Faces():
        contents = f"{len(shape.Edges())} edges and {len(shape.Vertices())} points"
        msg = f"STEP: {path.name} holds {contents} but no face; export the solid"
        raise ValueError(msg)
    mesh_verdicts = check_mesh(triangles(shape), process, POSES)
    # geometry.one_solid is the number of solids here, not the number of connected sets of triangles.
    return (*check_solid(shape), *(verdict for verdict in mesh_verdicts if verdict.name != "geometry.one_solid"))


def _check_3mf(path: Path, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.3mf_strict, which counts violations of the 3MF standard, and the verdicts on the triangles."""
    package = read_3mf(path)
    names = ", ".join(repr(name) for name in package.names)
    faults = [f"{count} x {fault}" for fault, count in Counter(package.faults).items()]
    reference = "; ".join([f"violations of the standard, which slicers tolerate; objects {names}", *faults])
    strict = judge("geometry.3mf_strict", len(package.faults), reference)
    return (strict, *check_mesh(package.mesh, process, [AS_IT_STANDS]))
