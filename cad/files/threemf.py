"""3MF [mm] by lib3mf: one named object a body, read back in strict mode."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import lib3mf
import numpy as np
import trimesh

_MILLIMETRES = {
    lib3mf.ModelUnit.MicroMeter: 1e-3, lib3mf.ModelUnit.MilliMeter: 1.0, lib3mf.ModelUnit.CentiMeter: 10.0,
    lib3mf.ModelUnit.Inch: 25.4, lib3mf.ModelUnit.Foot: 304.8, lib3mf.ModelUnit.Meter: 1e3,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Package:
    """What a 3MF file holds: all its triangles [mm], the names of its objects, and what the reader warned of."""

    mesh: trimesh.Trimesh
    names: tuple[str, ...]
    warnings: tuple[str, ...]


def write_3mf(bodies: Mapping[str, trimesh.Trimesh], path: Path) -> None:
    """Write closed meshes [mm] with merged corners, each as the object of its name; raises OSError."""
    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    for name, mesh in bodies.items():
        item = model.AddMeshObject()
        item.SetName(name)
        vertices = [lib3mf.Position(tuple(vertex)) for vertex in mesh.vertices.tolist()]
        faces = [lib3mf.Triangle(tuple(face)) for face in mesh.faces.tolist()]
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
    (merged,) = _mesh_objects(model.MergeToModel())
    vertices = [tuple(corner.Coordinates) for corner in merged.GetVertices()]
    faces = [tuple(face.Indices) for face in merged.GetTriangleIndices()]
    if not faces:
        msg = f"3MF: {path.name} holds no triangles; export it again"
        raise ValueError(msg)
    mesh = trimesh.Trimesh(_MILLIMETRES[model.GetUnit()] * np.array(vertices), faces, process=False)
    return Package(mesh=mesh, names=names, warnings=warnings)


def _mesh_objects(model: lib3mf.Model) -> list[lib3mf.MeshObject]:
    iterator = model.GetMeshObjects()
    objects = []
    while iterator.MoveNext():
        objects.append(iterator.GetCurrentMeshObject())
    return objects
