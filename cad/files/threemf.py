"""3MF [mm]: written by lib3mf, one named object a body; read as slicers do, and strictly by lib3mf for its faults."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import lib3mf
import trimesh

from cad.files.package import read_bodies


@dataclass(frozen=True, kw_only=True)
class Package:
    """What a 3MF file holds: all its triangles [mm], the names of its objects, and what breaks the standard."""

    mesh: trimesh.Trimesh
    names: tuple[str, ...]
    faults: tuple[str, ...]


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
    """Return the content of a 3MF file as slicers read it; raises ValueError when it holds no triangles.

    Equal corners within one object are merged, which the standard wants of the file: more than one is a fault.
    """
    try:
        bodies = read_bodies(path)
    except ValueError as error:
        msg = f"3MF: {path.name} cannot be read ({error}); export it again"
        raise ValueError(msg) from error
    if not bodies:
        msg = f"3MF: {path.name} holds no triangles; export it again"
        raise ValueError(msg)
    faults = list(_faults(path))
    meshes = []
    for body in bodies:
        mesh = trimesh.Trimesh(body.vertices, body.triangles, process=False)
        mesh.merge_vertices()
        if repeated := len(body.vertices) - len(mesh.vertices):
            faults.append(f"{repeated} vertices of object {body.name!r} stand on others or in no triangle")
        meshes.append(mesh)
    names = tuple(dict.fromkeys(body.name for body in bodies))
    corners, triangles = trimesh.util.append_faces([each.vertices for each in meshes], [each.faces for each in meshes])
    return Package(mesh=trimesh.Trimesh(corners, triangles, process=False), names=names, faults=tuple(faults))


def _faults(path: Path) -> tuple[str, ...]:
    """Return what lib3mf warns of in a file, and why it refuses it if it does."""
    reader = lib3mf.get_wrapper().CreateModel().QueryReader("3mf")
    refused = []
    try:
        reader.ReadFromFile(str(path))
    except lib3mf.ELib3MFException as error:
        refused = [str(error)]
    warnings = [text for _, text in (reader.GetWarning(i) for i in range(reader.GetWarningCount()))]
    return (*warnings, *refused)
