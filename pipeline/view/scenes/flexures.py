"""Scenes of the flexures: the housing on the side of one spring, under the force that its strain is judged at."""

from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.report.stored import StoredReport
from pipeline.view.scenes.field import DISPLACEMENT, FLEXURE_FIELDS, add_derived_fields, fields_on
from pipeline.view.scenes.mirrored import whole_model
from pipeline.view.scenes.scene import FieldScene, deformation_factor
from solve.housing.stiffness import SPRINGS, tip_face

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes

_DIRECTION = (0.25, -1.0, 0.45)


def flexure_scenes(report: StoredReport, half: Mesh) -> tuple[FieldScene, ...]:
    """Return the scene of each spring from the mesh and fields of the half housing [mm]; none where it has no tips."""
    marks = [tip_face(spring) for spring in SPRINGS]
    if DISPLACEMENT not in half.point_data or any(mark not in half.point_data for mark in marks):
        return ()
    mesh = whole_model(half)
    add_derived_fields(mesh, report.design.process.strain_limit)
    return tuple(_side(report, spring, side_of(mesh, spring)) for spring in SPRINGS)


def side_of(mesh: Mesh, spring: str) -> Mesh:
    """Return the cells of a whole housing [mm] on the side of one spring's tip, cut off midway between the tips."""
    x = np.asarray(mesh.points)[:, 0]
    places = [float(x[np.asarray(mesh.point_data[tip_face(name)]) == 1].mean()) for name in SPRINGS]
    middle, own = 0.5 * sum(places), places[SPRINGS.index(spring)]
    centres = np.asarray(mesh.cell_centers().points)[:, 0]
    return mesh.extract_cells(np.flatnonzero((centres - middle) * (own - middle) > 0.0))


def _side(report: StoredReport, spring: str, mesh: Mesh) -> FieldScene:
    scene = FieldScene(
        name=f"flexure-{spring}",
        title=f"{report.design.name}: {spring} spring",
        mesh=mesh,
        fields=fields_on(mesh, FLEXURE_FIELDS),
        factor=1.0,
        direction=_DIRECTION,
    )
    return replace(scene, factor=deformation_factor(scene.largest_displacement_mm, float(mesh.length)))
