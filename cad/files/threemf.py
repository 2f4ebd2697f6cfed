"""3MF [mm] by lib3mf: one named object a body, read back in strict mode."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import lib3mf
import numpy as np

from cad.triangles import Triangles

_MILLIMETRES = {
    lib3mf.ModelUnit.MicroMeter: 1e-3, lib3mf.ModelUnit.MilliMeter: 1.0, lib3mf.ModelUnit.CentiMeter: 10.0,
    lib3mf.ModelUnit.Inch: 25.4, lib3mf.ModelUnit.Foot: 304.8, lib3mf.ModelUnit.Meter: 1e3,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Package:
    """What a 3MF file holds: all its triangles [mm], the names of its objects, and what the reader warned of."""

    mesh: Triangles
    names: tuple[str, ...]
    warnings: tuple[str, ...]


def write_3mf(bodies: Mapping[str, Triangles], path: Path) -> None:
    """Write closed meshes [mm] with merged corners, each as the object of its name; raises OSError."""
    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    for name, mesh in bodies.items():
        item = model.AddMeshObject()
        item.SetName(name)
        vertices = [lib3mf.Position(tuple(vertex)) for vertex in np.asarray(mesh.vertices, dtype=float).tolist()]
        faces = [lib3mf.Triangle(tuple(face)) for face in np.asarray(mesh.faces).tolist()]
        item.SetGeometry(vertices, faces)
        model.AddBuildItem(item, wrapper.GetIdentityTransform())
    try:
        model.QueryWriter("3mf").WriteToFile(str(path))
    except lib3mf.ELib3MFException as error:
        msg = f"3MF: cannot write {path} ({error}); check that the folder exists and has room"
        raise OSError(msg) from error


def read_3mf(path: Path) -> Package:
    """Return the content of a 3MF file as lib3mf reads it in strict mode; raises ValueError when it refuses."""
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)  # noqa: FBT003 - the reader takes it in place
    try:
        reader.ReadFromFile(str(path))
    except lib3mf.ELib3MFException as error:
        msg = f"3MF: {path.name} is refused by lib3mf in strict mode ({error}); export it again"
        raise ValueError(msg) from error
    warnings = tuple(str(reader.GetWarning(i)) for i in range(reader.GetWarningCount()))
    names = tuple(item.GetName() for item in _mesh_objects(model))
    mesh = _joined(_mesh_objects(model.MergeToModel()), _MILLIMETRES[model.GetUnit()])
    if len(mesh.faces) == 0:
        msg = f"3MF: {path.name} holds no triangles; export it again"
        raise ValueError(msg)
    return Package(mesh=mesh, names=names, warnings=warnings)


def _mesh_objects(model: lib3mf.Model) -> list[lib3mf.MeshObject]:
    iterator = model.GetMeshObjects()
    objects = []
    while iterator.MoveNext():
        objects.append(iterator.GetCurrentMeshObject())
    return objects


def _joined(objects: list[lib3mf.MeshObject], scale: float) -> Triangles:
    """Return the triangles of all objects, their corners scaled."""
    vertices = [np.empty((0, 3))]
    faces = [np.empty((0, 3), dtype=np.int64)]
    first = 0
    for item in objects:
        corners = [list(corner.Coordinates) for corner in item.GetVertices()]
        indices = [list(face.Indices) for face in item.GetTriangleIndices()]
        vertices.append(scale * np.array(corners, dtype=float).reshape(-1, 3))
        faces.append(first + np.array(indices, dtype=np.int64).reshape(-1, 3))
        first += len(corners)
    return Triangles(vertices=np.concatenate(vertices), faces=np.concatenate(faces))
