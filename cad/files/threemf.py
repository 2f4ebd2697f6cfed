"""3MF [mm]: one named object a body, the same bytes every time; read back by lib3mf in strict mode."""

import re
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path

import lib3mf
import numpy as np
from lib3mf import ELib3MFException, get_wrapper

from cad.triangles import Triangles

_TYPES = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"""
_RELATIONS = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""
_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
 <resources>
"""
_SIGNED_INDEX = re.compile(rb"""<(?:\w+:)?triangle\b[^>]*\bv[123]\s*=\s*["']\s*[^0-9\s]""")
_START_OF_ZIP = (1980, 1, 1, 0, 0, 0)
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
    objects = "".join(_object(place, name, mesh) for place, (name, mesh) in enumerate(bodies.items(), start=1))
    items = "".join(f'  <item objectid="{place}"/>\n' for place in range(1, len(bodies) + 1))
    model = f"{_HEAD}{objects} </resources>\n <build>\n{items} </build>\n</model>\n"
    with zipfile.ZipFile(path, "w") as package:
        for name, text in (("[Content_Types].xml", _TYPES), ("_rels/.rels", _RELATIONS), ("3D/3dmodel.model", model)):
            entry = zipfile.ZipInfo(name, date_time=_START_OF_ZIP)
            entry.compress_type, entry.create_system = zipfile.ZIP_DEFLATED, 0
            package.writestr(entry, text, compresslevel=9)


def _object(place: int, name: str, mesh: Triangles) -> str:
    corners = "".join(f'     <vertex x="{x:.6f}" y="{y:.6f}" z="{z:.6f}"/>\n' for x, y, z in np.asarray(mesh.vertices))
    faces = "".join(f'     <triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in np.asarray(mesh.faces))
    return (
        f'  <object id="{place}" type="model" name="{_escaped(name)}">\n   <mesh>\n    <vertices>\n{corners}'
        f"    </vertices>\n    <triangles>\n{faces}    </triangles>\n   </mesh>\n  </object>\n"
    )


def _escaped(name: str) -> str:
    """Return a name as it stands in an attribute; an apostrophe stays as it is, for lib3mf refuses `&#x27;`."""
    return escape(name, quote=False).replace('"', "&quot;")


def read_3mf(path: Path) -> Package:
    """Return the content of a 3MF file as lib3mf reads it in strict mode; raises ValueError when it refuses."""
    _refuse_signed_indices(path)
    model = get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)  # noqa: FBT003 - the reader takes it in place
    try:
        reader.ReadFromFile(str(path))
    except ELib3MFException as error:
        msg = f"3MF: {path.name} is refused by lib3mf in strict mode ({error}); export it again"
        raise ValueError(msg) from error
    warnings = tuple(str(reader.GetWarning(i)) for i in range(reader.GetWarningCount()))
    names = tuple(item.GetName() for item in _meshes(model))
    mesh = _joined(_meshes(model.MergeToModel()), _MILLIMETRES[model.GetUnit()])
    if len(mesh.faces) == 0:
        msg = f"3MF: {path.name} holds no triangles; export it again"
        raise ValueError(msg)
    return Package(mesh=mesh, names=names, warnings=warnings)


def _refuse_signed_indices(path: Path) -> None:
    """Raise ValueError where a triangle has an index with a sign: lib3mf reads -4294967295 as 1."""
    try:
        with zipfile.ZipFile(path) as package:
            models = [package.read(name) for name in package.namelist() if name.lower().endswith(".model")]
    except (OSError, ValueError, RuntimeError, NotImplementedError, zipfile.BadZipFile, zlib.error) as error:
        msg = f"3MF: {path.name} cannot be unpacked ({error}); export it again"
        raise ValueError(msg) from error
    if any(_SIGNED_INDEX.search(model) for model in models):
        msg = f"3MF: {path.name} has a triangle with an index that is no whole number from 0; export it again"
        raise ValueError(msg)


def _meshes(model: lib3mf.Model) -> list[lib3mf.MeshObject]:
    iterator, objects = model.GetMeshObjects(), []
    while iterator.MoveNext():
        objects.append(iterator.GetCurrentMeshObject())
    return objects


def _joined(items: list[lib3mf.MeshObject], scale: float) -> Triangles:
    """Return the triangles of all objects, their corners [mm] scaled."""
    corners = [list(corner.Coordinates) for item in items for corner in item.GetVertices()]
    starts = np.cumsum([0, *(item.GetVertexCount() for item in items)])
    faces = [
        np.array([list(face.Indices) for face in item.GetTriangleIndices()], dtype=np.int64).reshape(-1, 3) + start
        for item, start in zip(items, starts, strict=False)
    ]
    vertices = scale * np.array(corners, dtype=float).reshape(-1, 3)
    return Triangles(vertices=vertices, faces=np.concatenate([np.empty((0, 3), dtype=np.int64), *faces]))
