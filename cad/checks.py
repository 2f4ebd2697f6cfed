"""Geometry verdicts: on any solid, and on a sensor together with the files written from it."""

from pathlib import Path

import cadquery as cq
import numpy as np
import trimesh
from OCP.BRepCheck import BRepCheck_Analyzer

from cad.clearance import clearance_findings, stop_findings
from cad.export import sensor_pose
from cad.finding import Finding, equal
from cad.leaves import leaf_findings
from cad.line import Lines, MeshLines, SolidLines
from cad.sensor import Sensor
from cad.step import read_step
from cad.stl import read_stl

ROUND_TRIP_TOLERANCE = 1e-9  # Part 21 carries 15 digits


def check_solid(shape: cq.Shape) -> tuple[Finding, ...]:
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


def check_mesh(mesh: trimesh.Trimesh) -> tuple[Finding, ...]:
    """Return geometry.watertight: the number of edges that do not join two triangles of one sense."""
    _, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    loose = int((counts != 2).sum())  # noqa: PLR2004 - an edge of a closed surface joins two triangles
    faulty = loose if loose or mesh.is_winding_consistent else 1
    reference = f"edges that do not join two triangles of one sense, of {len(counts)}"
    return (equal("geometry.watertight", float(faulty), 0.0, 0.0, unit="1", reference=reference),)


def check_sensor(sensor: Sensor, deflections: tuple[float, float], folder: Path) -> tuple[Finding, ...]:
    """Return every geometry verdict on a sensor and on housing.step and housing.stl in a folder.

    The deflections [mm] of low and high spring are those at full travel. Raises OSError for a missing file.
    """
    shape = sensor.part.shape
    step = read_step(folder / "housing.step")
    stl = sensor_pose(read_stl(folder / "housing.stl"), sensor.housing.depth)
    forms: dict[str, Lines] = {"solid": SolidLines(shape), "STEP": SolidLines(step), "STL": MeshLines(stl)}
    return (
        *check_solid(shape),
        *check_mesh(stl),
        _round_trip(shape, step),
        *leaf_findings(sensor.housing, forms),
        *clearance_findings(sensor),
        *stop_findings(sensor, deflections),
    )


def _round_trip(shape: cq.Shape, step: cq.Shape) -> Finding:
    """Return geometry.step_round_trip: relative change of the volume from the solid to the file read back."""
    change = step.Volume() / shape.Volume() - 1.0
    reference = f"volume of housing.step against the solid, {shape.Volume():.6f} mm^3"
    return equal("geometry.step_round_trip", change, 0.0, ROUND_TRIP_TOLERANCE, unit="1", reference=reference)
