"""3MF files [mm], written with one named object per body, and read by lib3mf, whose warnings are reported as faults.

Print settings can be stored in addition to the objects, as in a PrusaSlicer project. Other programs ignore them.
"""

import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from xml.sax.saxutils import quoteattr

import lib3mf
import numpy as np
import trimesh

from cad.files.file_date import file_date
from sensor.arrays import Floats

_XML = '<?xml version="1.0" encoding="UTF-8"?>\n'
_SCHEMAS = "http://schemas.openxmlformats.org/package/2006"
_MICROSOFT = "http://schemas.microsoft.com/3dmanufacturing"
# The parts of a package that describe its types and its entry point. `write_3mf` replaces {more}.
_FRAME = {
    "[Content_Types].xml": f'{_XML}<Types xmlns="{_SCHEMAS}/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>{more}</Types>',
    "_rels/.rels": f'{_XML}<Relationships xmlns="{_SCHEMAS}/relationships">'
    f'<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="{_MICROSOFT}/2013/01/3dmodel"/></Relationships>',
}
_MODEL = (
    f'{_XML}<model unit="millimeter" xml:lang="en-US" xmlns="{_MICROSOFT}/core/2015/02"><resources>\n'
    "{objects}\n</resources><build>{items}</build></model>\n"
)
# The file with PrusaSlicer's settings for single objects, which override the settings of the print profile.
_SETTINGS = "Metadata/Slic3r_PE_model.config"
_SETTINGS_TYPE = '<Default Extension="config" ContentType="text/xml"/>'
_UNKNOWN_ATTRIBUTE = 0x80A7  # lib3mf's NMR_ERROR_NAMESPACE_INVALID_ATTRIBUTE
_MILLIMETRES = {
    lib3mf.ModelUnit.MicroMeter: 1e-3,
    lib3mf.ModelUnit.MilliMeter: 1.0,
    lib3mf.ModelUnit.CentiMeter: 10.0,
    lib3mf.ModelUnit.Inch: 25.4,
    lib3mf.ModelUnit.Foot: 304.8,
    lib3mf.ModelUnit.Meter: 1e3,
}
_EARLIEST_ZIP_DATE = datetime(1980, 1, 1, tzinfo=UTC)  # the earliest date of an entry in a ZIP archive


@dataclass(frozen=True, kw_only=True)
class Package:
    """The contents of a 3MF file: its triangles [mm], the names of its objects, and its violations of the standard."""

    mesh: trimesh.Trimesh
    names: tuple[str, ...]
    faults: tuple[str, ...]


def write_3mf(bodies: Mapping[str, trimesh.Trimesh], path: Path, settings: Mapping[str, str] | None = None) -> None:
    """Write closed meshes with merged vertices [mm] as the objects of a 3MF file; `bodies` holds them by name.

    `settings` holds the PrusaSlicer settings of all objects, by key. All entries of the package, which is a ZIP
    archive, have the date of `file_date`. The package has no extensions and no 64-bit sizes, so that old slicers can
    read it. Raises OSError if the file cannot be written.
    """
    objects = [_object_text(number, name, mesh) for number, (name, mesh) in enumerate(bodies.items(), start=1)]
    items = [f'<item objectid="{number}"/>' for number in range(1, len(bodies) + 1)]
    settings_type = _SETTINGS_TYPE if settings else ""
    entries = {name: text.replace("{more}", settings_type) for name, text in _FRAME.items()}
    entries["3D/3dmodel.model"] = _MODEL.format(objects="\n".join(objects), items="".join(items))
    if settings:
        entries[_SETTINGS] = _settings_text(bodies, settings)
    date = max(file_date(), _EARLIEST_ZIP_DATE).timetuple()[:6]  # year, month, day, hour, minute and second
    with zipfile.ZipFile(path, "w") as package:
        for name, text in entries.items():
            entry = zipfile.ZipInfo(name, date)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 0  # so that the bytes do not depend on the operating system
            package.writestr(entry, text)


def _settings_text(bodies: Mapping[str, trimesh.Trimesh], settings: Mapping[str, str]) -> str:
    """Return XML with the settings of each object, and with the range of its triangles, which PrusaSlicer requires.

    `bodies` holds the objects by name, and `settings` holds the settings by key, which are the same for all objects.
    """
    entries = "".join(
        f'  <metadata type="object" key={quoteattr(key)} value={quoteattr(value)}/>\n'
        for key, value in settings.items()
    )
    # The triangles of each object are numbered from 0.
    objects = "".join(
        f' <object id="{number}">\n  <metadata type="object" key="name" value={quoteattr(name)}/>\n{entries}'
        f'  <volume firstid="0" lastid="{len(mesh.faces) - 1}"/>\n </object>\n'
        for number, (name, mesh) in enumerate(bodies.items(), start=1)
    )
    return f"{_XML}<config>\n{objects}</config>\n"


def _object_text(number: int, name: str, mesh: trimesh.Trimesh) -> str:
    """Return the XML of an object with this number, name and mesh.

    Nine significant digits represent a single-precision number exactly.
    """
    vertices = "\n".join('<vertex x="{:.9g}" y="{:.9g}" z="{:.9g}"/>'.format(*row) for row in mesh.vertices.tolist())
    triangles = "\n".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*row) for row in mesh.faces.tolist())
    mesh_text = f"<mesh><vertices>\n{vertices}\n</vertices><triangles>\n{triangles}\n</triangles></mesh>"
    return f'<object id="{number}" name={quoteattr(name)} type="model">{mesh_text}</object>'


def read_3mf(path: Path) -> Package:
    """Read the objects to be printed from a 3MF file with lib3mf.

    Equal vertices of an object are merged. Such vertices are reported as a fault, because the standard requires merged
    vertices. Raises ValueError if the file cannot be read or holds no triangles.
    """
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    try:
        reader.ReadFromFile(str(path))
        bodies = list(_printed_meshes(model))
        printable_count = _count_printable(path)
    except (lib3mf.ELib3MFException, zipfile.BadZipFile, ValueError) as error:
        msg = f"3MF: {path.name} cannot be read ({error}); export it again"
        raise ValueError(msg) from error
    if not bodies:
        msg = f"3MF: {path.name} holds no triangles; export it again"
        raise ValueError(msg)
    faults = (*_reader_faults(reader, printable_count), *_merge_equal_vertices(bodies))
    names = tuple(dict.fromkeys(name for name, _ in bodies))  # each name once, in the order of the file
    meshes = [mesh for _, mesh in bodies]
    # All bodies become one mesh, in which no two bodies share a vertex.
    corners, triangles = trimesh.util.append_faces([mesh.vertices for mesh in meshes], [mesh.faces for mesh in meshes])
    return Package(mesh=trimesh.Trimesh(corners, triangles, process=False), names=names, faults=faults)


def _merge_equal_vertices(bodies: Sequence[tuple[str, trimesh.Trimesh]]) -> list[str]:
    """Merge the equal vertices of each body in place, and return a fault for each body whose vertices were not unique.

    Vertices that belong to no triangle are removed, and are counted too. `bodies` holds the names and the meshes of the
    bodies.
    """
    faults = []
    for name, mesh in bodies:
        vertex_count = len(mesh.vertices)
        mesh.merge_vertices()
        removed_count = vertex_count - len(mesh.vertices)
        if removed_count:
            faults.append(f"{removed_count} vertices of object {name!r} are duplicates or belong to no triangle")
    return faults


def _printed_meshes(model: lib3mf.Model) -> Iterator[tuple[str, trimesh.Trimesh]]:
    """Yield the name and the triangles of each mesh to be printed, in its position on the bed [mm].

    The items to be printed refer to objects. An object is a mesh, or consists of other objects. Raises ValueError if a
    coordinate is not a finite number.
    """
    items = model.GetBuildItems()
    while items.MoveNext():
        item = items.GetCurrent()
        # Transforms are in the unit of the file, so they are applied before the conversion to millimetres.
        placement = _transform_matrix(item.GetObjectTransform())
        for name, mesh in _placed_meshes(item.GetObjectResource(), placement):
            mesh.vertices *= _MILLIMETRES[model.GetUnit()]
            yield name, mesh


def _placed_meshes(body: lib3mf.Object, placement: Floats) -> Iterator[tuple[str, trimesh.Trimesh]]:
    """Yield the name and the mesh of an object, or of each of its components, in the unit of the file.

    `placement` (4, 4) is the transform of the object. Objects whose type is not `model`, such as supports, are skipped,
    and so are empty meshes. Raises ValueError if a coordinate is not a finite number.
    """
    if body.GetType() != lib3mf.ObjectType.Model:
        return
    if not body.IsMeshObject():  # the object consists of other objects
        for number in range(body.GetComponentCount()):
            component = body.GetComponent(number)
            component_placement = placement @ _transform_matrix(component.GetTransform())
            yield from _placed_meshes(component.GetObjectResource(), component_placement)
        return
    if body.GetTriangleCount():
        corners = np.array([corner.Coordinates[:] for corner in body.GetVertices()], dtype=float)
        if not np.isfinite(corners).all():
            msg = f"a coordinate of object {body.GetName()!r} is not a finite number"
            raise ValueError(msg)
        triangles = np.array([triangle.Indices[:] for triangle in body.GetTriangleIndices()])
        mesh = trimesh.Trimesh(corners, triangles, process=False)
        mesh.apply_transform(placement)  # it also reverses the triangles of a mirrored mesh, as slicers do
        yield body.GetName(), mesh


def _transform_matrix(transform: lib3mf.Transform) -> Floats:
    """Return the matrix (4, 4) that maps column vectors like a lib3mf transform.

    The rows of the transform (4, 3) are the images of the three axes and of the origin.
    """
    matrix = np.eye(4)
    matrix[:3] = np.array([row[:] for row in transform.Fields]).T
    return matrix


def _count_printable(path: Path) -> int:
    """Count the items with the attribute `printable`, which slicers write although no standard defines it."""
    with zipfile.ZipFile(path) as package:
        models = [name for name in package.namelist() if name.lower().endswith(".model")]
        return sum(package.read(name).count(b" printable=") for name in models)


def _reader_faults(reader: lib3mf.Reader, printable_count: int) -> list[str]:
    """Return lib3mf's warnings about a file, except the warnings about the attribute `printable`.

    For each of the `printable_count` items with this attribute, lib3mf warns once. The attribute is not a fault,
    because all slicers write and read it. Further warnings about unknown attributes are faults.
    """
    faults = []
    expected_warnings = printable_count
    warnings = (reader.GetWarning(number) for number in range(reader.GetWarningCount()))
    for code, text in warnings:
        if code == _UNKNOWN_ATTRIBUTE and expected_warnings > 0:
            expected_warnings -= 1
        else:
            faults.append(text)
    return faults
