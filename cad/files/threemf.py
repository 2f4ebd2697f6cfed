"""3MF [mm]: one named object a body; read as slicers do, and strictly by lib3mf for its faults."""

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from xml.sax.saxutils import quoteattr

import lib3mf
import trimesh

from cad.files.file_date import file_date
from cad.files.package import read_build

_XML = '<?xml version="1.0" encoding="UTF-8"?>\n'
_SCHEMAS = "http://schemas.openxmlformats.org/package/2006"
_MICROSOFT = "http://schemas.microsoft.com/3dmanufacturing"
_FRAME = {
    "[Content_Types].xml": f'{_XML}<Types xmlns="{_SCHEMAS}/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>',
    "_rels/.rels": f'{_XML}<Relationships xmlns="{_SCHEMAS}/relationships">'
    f'<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="{_MICROSOFT}/2013/01/3dmodel"/></Relationships>',
}
_MODEL = (
    f'{_XML}<model unit="millimeter" xml:lang="en-US" xmlns="{_MICROSOFT}/core/2015/02"><resources>\n'
    "{objects}\n</resources><build>{items}</build></model>\n"
)
_UNKNOWN_ATTRIBUTE = 0x80A7  # lib3mf's NMR_ERROR_NAMESPACE_INVALID_ATTRIBUTE
_FIRST_ZIP_DAY = datetime(1980, 1, 1, tzinfo=UTC)  # before it no entry of an archive can be dated


@dataclass(frozen=True, kw_only=True)
class Package:
    """What a 3MF file holds: all its triangles [mm], the names of its objects, and what breaks the standard."""

    mesh: trimesh.Trimesh
    names: tuple[str, ...]
    faults: tuple[str, ...]


def write_3mf(bodies: Mapping[str, trimesh.Trimesh], path: Path) -> None:
    """Write closed meshes [mm] with merged corners, each as the object of its name; raises OSError.

    The package is dated `file_date` and as plain as can be, without extensions and 64-bit sizes, for old slicers.
    """
    meshes = [_object_text(number, name, mesh) for number, (name, mesh) in enumerate(bodies.items(), start=1)]
    items = [f'<item objectid="{number}"/>' for number in range(1, len(bodies) + 1)]
    parts = {**_FRAME, "3D/3dmodel.model": _MODEL.format(objects="\n".join(meshes), items="".join(items))}
    date = max(file_date(), _FIRST_ZIP_DAY).timetuple()[:6]
    with zipfile.ZipFile(path, "w") as package:
        for name, text in parts.items():
            part = zipfile.ZipInfo(name, date)
            part.compress_type = zipfile.ZIP_DEFLATED
            part.create_system = 0  # the same on every system
            package.writestr(part, text)


def _object_text(number: int, name: str, mesh: trimesh.Trimesh) -> str:
    """Return the XML of an object; nine digits hold what an STL holds."""
    vertices = "\n".join('<vertex x="{:.9g}" y="{:.9g}" z="{:.9g}"/>'.format(*row) for row in mesh.vertices.tolist())
    triangles = "\n".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*row) for row in mesh.faces.tolist())
    content = f"<mesh><vertices>\n{vertices}\n</vertices><triangles>\n{triangles}\n</triangles></mesh>"
    return f'<object id="{number}" name={quoteattr(name)} type="model">{content}</object>'


def read_3mf(path: Path) -> Package:
    """Return the content of a 3MF file as slicers read it; raises ValueError when it holds no triangles.

    Equal corners within one object are merged, which the standard wants of the file: more than one is a fault.
    """
    try:
        build = read_build(path)
    except ValueError as error:
        msg = f"3MF: {path.name} cannot be read ({error}); export it again"
        raise ValueError(msg) from error
    bodies = build.bodies
    if not bodies:
        msg = f"3MF: {path.name} holds no triangles; export it again"
        raise ValueError(msg)
    faults = _faults(path, build.marked_printable)
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


def _faults(path: Path, marked_printable: int) -> list[str]:
    """Return the warnings of lib3mf on a file, and its reason where it refuses the file.

    It warns of each item with `printable`, which the projects of slicers have and every slicer knows: no faults.
    """
    reader = lib3mf.get_wrapper().CreateModel().QueryReader("3mf")
    refused = []
    try:
        reader.ReadFromFile(str(path))
    except lib3mf.ELib3MFException as error:
        refused = [str(error)]
    faults = []
    for code, text in (reader.GetWarning(i) for i in range(reader.GetWarningCount())):
        if code == _UNKNOWN_ATTRIBUTE and marked_printable > 0:
            marked_printable -= 1
        else:
            faults.append(text)
    return faults + refused
