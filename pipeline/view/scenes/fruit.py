"""The scene of the fruit: what the tips press into it, bent to its true shape and cut through a row of tips."""

from typing import Any

import numpy as np

from cad.design.parameters import Design
from pipeline.view.scenes.field import DISPLACEMENT, FRUIT_FIELDS, add_derived_fields, fields_on
from pipeline.view.scenes.scene import Cut, FieldScene, Vector
from solve.fruit.curved_body import core_of
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.smooth_load import smooth_loads
from solve.fruit.split import contact_footprints

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes

_DIRECTION = (0.2, -1.0, 0.55)
_NEAR = 0.4  # of the spacing of the tips: how far around them the picture reaches


def fruit_scene(design: Design, block: Mesh) -> FieldScene | None:
    """Return the scene of a fruit from the mesh of its block and its fields [mm]; None where there are no fields."""
    if DISPLACEMENT not in block.point_data:
        return None
    mesh = on_true_shape(design, block)
    add_derived_fields(mesh)
    row = min(y for _, y in design.tips.places_mm)
    return FieldScene(
        name="fruit",
        title=f"{design.name}: fruit under the tips, cut through {'a row' if row else 'the row'} of them",
        mesh=mesh,
        fields=fields_on(mesh, FRUIT_FIELDS),
        factor=1.0,
        direction=_DIRECTION,
        cut=Cut(origin=(0.0, row, 0.0), normal=(0.0, -1.0, 0.0)),
        focus=_around_tips(design, mesh),
    )


def on_true_shape(design: Design, block: Mesh) -> Mesh:
    """Return the block of a fruit [mm] bent to the fruit: a sphere's or an ellipsoid's skin where it has one."""
    mesh = block.copy()
    if design.fruit.radius_mm is None:
        return mesh
    footprints = contact_footprints(design.fruit, design.tips)
    shape = CurvedShape(design.fruit, core_of(smooth_loads(design.fruit, footprints)))
    downward = np.array([1.0, 1.0, -1.0])
    mesh.points = shape.bent((np.asarray(block.points) * downward).T).T * downward
    return mesh


def _around_tips(design: Design, mesh: Mesh) -> tuple[Vector, Vector]:
    """Return the ends of a box [mm] about the tips, within the fruit."""
    x, y = np.array(design.tips.places_mm).T
    lower, upper = np.array(mesh.bounds).reshape(3, 2).T
    reach = _NEAR * design.tips.spacing_mm
    first = np.maximum(lower, [x.min() - reach, y.min(), -0.5 * (float(np.ptp(x)) + reach)])
    last = np.minimum(upper, [x.max() + reach, y.max() + reach, upper[2]])
    return tuple(first.tolist()), tuple(last.tolist())
