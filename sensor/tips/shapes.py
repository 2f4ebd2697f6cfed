"""All shapes of tips, and the shape that the keys in [tips] describe. A new shape is a file and its entries here."""

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
    """The keys in [tips] that belong only to some shapes."""


OPTIONAL_KEYS = tuple(key.name for key in dataclasses.fields(ShapeKeys) if key.default is None)


def tip_shape(name: str, side_mm: float, keys: ShapeKeys) -> TipShape:
    """Return the tip shape with this name and the outline `side_mm`, with the values of its own keys.

    A key belongs to a shape if the class of the shape has a field with its name. Raises InputError if a key of another
    shape is set, or if a key of this shape whose field has no default is missing.
    """
    kind = SHAPES[name]
    fields = {item.name: item for item in dataclasses.fields(kind)}
    values = {}
    for key in dataclasses.fields(ShapeKeys):
        value = getattr(keys, key.name)
        label = f"tips.{key.name}"
        if key.name not in fields:
            if value != key.default:
                bound = f"left out for tips.shape = {name!r}"
                hint = "drop it, or take the shape it is for"
                raise validation_error(label, value, key.metadata["unit"], bound, hint)
        elif value is not None:
            values[key.name] = value
        elif fields[key.name].default is dataclasses.MISSING:
            bound = f"given for tips.shape = {name!r}"
            raise validation_error(label, None, "", bound, key.metadata["hint"])
    return kind(side_mm=side_mm, **values)
