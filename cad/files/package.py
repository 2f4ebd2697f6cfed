"""The triangles of a 3MF package [mm] as slicers read them.

Only build items, components, meshes, transforms and units are read. Every other element and attribute is passed over.
3MF Core Specification 1.3 and 3MF Production Extension 1.1, whose `path` names another model of the package.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers.expat import ExpatError, ParserCreate

import numpy as np
from numpy.typing import NDArray

from sensor.arrays import Floats

Indices = NDArray[np.int64]
_Start = Callable[[str, dict[str, str]], None]

_MILLIMETRES = {
    "micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1e3,
}  # fmt: skip
_MODEL_TYPE = "/3dmodel"  # end of the type of the relationship that names the root model
_NOT_PRINTED = ("support", "solidsupport", "other")  # types of objects that are no part
_DEEPEST = 32  # components within components; more are a circle
_IN_PLACE = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])


@dataclass(frozen=True, kw_only=True)
class Body:
    """A mesh in its place on the bed [mm]: the name of its object, vertices (n, 3) and triangles (m, 3)."""

    name: str
    vertices: Floats
    triangles: Indices


@dataclass(frozen=True, kw_only=True)
class Build:
    """The meshes that the build of a 3MF file puts on the bed, and how many items have the attribute `printable`.

    Slicers write it into their projects, though the standard has no such attribute.
    """

    bodies: list[Body]
    marked_printable: int


@dataclass(frozen=True, kw_only=True)
class _Use:
    """An object that a build item or a component puts in place: at (x, y, z, 1) times `placement`, (4, 3) [mm]."""

    model: str
    object_id: str
    placement: Floats


@dataclass(kw_only=True)
class _Object:
    """An object of a model, whose numbers are still those of the file."""

    name: str = ""
    kind: str = "model"
    vertices: list[tuple[str, str, str]] = field(default_factory=list)
    triangles: list[tuple[str, str, str]] = field(default_factory=list)
    components: list[_Use] = field(default_factory=list)


@dataclass(kw_only=True)
class _Model:
    """One model of a package, filled by the events of its XML."""

    path: str
    millimetres: float = 1.0
    objects: dict[str, _Object] = field(default_factory=dict)
    items: list[_Use] = field(default_factory=list)
    marked_printable: int = 0
    open_object: _Object = field(default_factory=_Object)
    in_mesh: bool = False

    def start(self, element: str, prefixed: dict[str, str]) -> None:
        """Take the start of an element; raises KeyError or ValueError for one without what it must have."""
        tag = _local(element)
        if self.in_mesh and tag == "vertex":  # nearly all elements are these two, whose attributes have no prefix
            self.open_object.vertices.append((prefixed["x"], prefixed["y"], prefixed["z"]))
            return
        if self.in_mesh and tag == "triangle":
            self.open_object.triangles.append((prefixed["v1"], prefixed["v2"], prefixed["v3"]))
            return
        attributes = {_local(name): value for name, value in prefixed.items()}
        if tag == "model":
            self.millimetres = _MILLIMETRES[attributes.get("unit", "millimeter")]
        elif tag == "object":
            self.open_object = _Object(name=attributes.get("name", ""), kind=attributes.get("type", "model"))
            self.objects[attributes["id"]] = self.open_object
        elif tag == "mesh":
            self.in_mesh = True
        elif tag == "component":
            self.open_object.components.append(self._use(attributes))
        elif tag == "item":
            self.items.append(self._use(attributes))
            self.marked_printable += "printable" in prefixed

    def end(self, element: str) -> None:
        """Take the end of an element."""
        if _local(element) == "mesh":
            self.in_mesh = False

    @property
    def uses(self) -> list[_Use]:
        """Return every use of an object by an item or a component."""
        return [*self.items, *(use for each in self.objects.values() for use in each.components)]

    def _use(self, attributes: Mapping[str, str]) -> _Use:
        placement = _IN_PLACE.copy()
        if "transform" in attributes:
            placement = np.array(attributes["transform"].split(), dtype=float).reshape(4, 3)
        placement[3] *= self.millimetres
        model = _part_name(attributes["path"]) if "path" in attributes else self.path
        return _Use(model=model, object_id=attributes["objectid"], placement=placement)


def read_build(path: Path) -> Build:
    """Return what a 3MF file puts on the bed; raises ValueError for a file without a model."""
    try:
        with zipfile.ZipFile(path) as package:
            parts = {_part_name(name): name for name in package.namelist()}
            root = _read_model(package, parts, _root_name(package, parts))
            others = {use.model for use in root.uses} - {root.path}
            models = {name: _read_model(package, parts, name) for name in sorted(others)} | {root.path: root}
        bodies = [body for item in root.items for body in _bodies(models, item, _IN_PLACE)]
        return Build(bodies=bodies, marked_printable=sum(model.marked_printable for model in models.values()))
    except KeyError as error:
        msg = f"{error.args[0]!r} is missing or is not one that 3MF knows"
        raise ValueError(msg) from error
    except (zipfile.BadZipFile, ExpatError, RuntimeError, NotImplementedError, EOFError, OverflowError) as error:
        raise ValueError(str(error)) from error


def _local(name: str) -> str:
    """Return the name of an element or attribute without its prefix."""
    return name.rpartition(":")[2]


def _part_name(name: str) -> str:
    """Return the name of a part of a package as it is compared: without a leading slash, in small letters."""
    return name.replace("\\", "/").lstrip("/").lower()


def _root_name(package: zipfile.ZipFile, parts: Mapping[str, str]) -> str:
    """Return the name of the root model: the one that the package relates to, else the first."""
    targets: list[str] = []

    def start(_: str, attributes: dict[str, str]) -> None:
        if attributes.get("Type", "").endswith(_MODEL_TYPE):
            targets.append(_part_name(attributes.get("Target", "")))

    if "_rels/.rels" in parts:
        _parse(package, parts["_rels/.rels"], start)
    models = [target for target in targets if target in parts] or sorted(n for n in parts if n.endswith(".model"))
    if not models:
        msg = "there is no model in the package"
        raise ValueError(msg)
    return models[0]


def _read_model(package: zipfile.ZipFile, parts: Mapping[str, str], name: str) -> _Model:
    """Return a model of a package; raises KeyError where there is none of the name."""
    model = _Model(path=name)
    _parse(package, parts[name], model.start, model.end)
    return model


def _parse(package: zipfile.ZipFile, part: str, start: _Start, end: Callable[[str], None] | None = None) -> None:
    """Call `start` for each element of a part that is XML, with its attributes, and `end` at its end."""
    parser = ParserCreate()
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    with package.open(part) as text:
        parser.ParseFile(text)


def _bodies(models: Mapping[str, _Model], use: _Use, outer: Floats, depth: int = 0) -> Iterator[Body]:
    """Yield the meshes of an object and of its components, each in its place."""
    if depth > _DEEPEST:
        msg = f"components lie more than {_DEEPEST} deep within each other"
        raise ValueError(msg)
    model = models[use.model]
    found = model.objects[use.object_id]
    if found.kind in _NOT_PRINTED:
        return
    placement = use.placement @ outer[:3]
    placement[3] += outer[3]
    if found.triangles:
        yield _body(found, model.millimetres, placement)
    for component in found.components:
        yield from _bodies(models, component, placement, depth + 1)


def _body(found: _Object, millimetres: float, placement: Floats) -> Body:
    """Return a mesh in its place; a transform that mirrors turns its triangles, as slicers do."""
    vertices = millimetres * np.array(found.vertices, dtype=float).reshape(-1, 3)
    triangles = np.array(found.triangles, dtype=np.int64)
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        msg = f"a triangle of object {found.name!r} has a corner beyond its {len(vertices)} vertices"
        raise ValueError(msg)
    if not np.isfinite(vertices).all():
        msg = f"a vertex of object {found.name!r} is no number"
        raise ValueError(msg)
    if np.linalg.det(placement[:3]) < 0.0:
        triangles = triangles[:, ::-1]
    return Body(name=found.name, vertices=vertices @ placement[:3] + placement[3], triangles=triangles)
