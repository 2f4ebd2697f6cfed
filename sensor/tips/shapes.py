"""The list of all tip shapes, and the conversion of the keys in [tips] to a shape.

To add a shape, write a file for it, and add the shape and its keys here.
"""

import dataclasses
from dataclasses import dataclass

from sensor.quantity import validation_error
from sensor.tips.ball import Dome, DomeKeys, Sphere
from sensor.tips.cone import Cone, ConeKeys
from sensor.tips.flat import Cube, Cylinder, FlatKeys
from sensor.tips.tip_shape import TipShape

SHAPES: dict[str, type[TipShape]] = {shape.name: shape for shape in (Cube, Cylinder, Sphere, Dome, Cone)}


@dataclass(frozen=True, kw_only=True)
class ShapeKeys(FlatKeys, DomeKeys, ConeKeys):
    """The keys in [tips] that only some shapes have."""


OPTIONAL_KEYS = tuple(key.name for key in dataclasses.fields(ShapeKeys) if key.default is None)


def tip_shape(name: str, side_mm: float, keys: ShapeKeys) -> TipShape:
    """Return the tip shape with this name, the outline `side_mm` [mm], and the values of its keys in `keys`.

    `side_mm` is the side of a square outline or the diameter of a round one. A key belongs to a shape if the class of
    the shape has a field of the same name. Raises InputError if a key is set that does not belong to the shape, or if a
    key without a default is missing.
    """
    shape_class = SHAPES[name]
    fields = {item.name: item for item in dataclasses.fields(shape_class)}
    values = {}
    for key in dataclasses.fields(ShapeKeys):
        value = getattr(keys, key.name)
        label = f"tips.{key.name}"
        if key.name not in fields:
            if value != key.default:  # the user has set a key of another shape
                bound = f"left out for tips.shape = {name!r}"
                hint = "remove it, or choose a shape that has this key"
                raise validation_error(label, value, key.metadata["unit"], bound, hint)
        elif value is not None:
            values[key.name] = value
        elif fields[key.name].default is dataclasses.MISSING:
            bound = f"given for tips.shape = {name!r}"
            raise validation_error(label, None, "", bound, key.metadata["hint"])
    return shape_class(side_mm=side_mm, **values)
