"""An output folder as one self-contained web page: its bodies with their fields."""

from pathlib import Path

import numpy as np

from cad.files.glb import GlbBody
from pipeline.report.page.page_bodies import ColourScale, assembly_body, field_body
from pipeline.report.page.page_template import BODIES, FIGURES, render_page
from pipeline.report.report import Report, read_report
from pipeline.storage.files import refuse_taken, write_files
from pipeline.storage.plain import Plain
from pipeline.view.field_picture import DISPLACEMENT, Field, FieldPicture, deformed_surface
from pipeline.view.scenes import field_scenes
from sensor.quantity import validation_error

FLAG = "--html"


def write_web_page(folder: Path, path: Path, *, force: bool = False) -> Path:
    """Write the bodies of an output folder with their fields as one web page; return its path.

    Raises InputError if the folder has no body, and if the path does not end in .html or cannot be written. A foreign
    file at this path is refused too, unless `force` keeps it as NAME.bak.
    """
    if path.suffix != ".html":
        hint = f"write {path.with_suffix('.html').name}"
        raise validation_error(FLAG, str(path), "", "a file name that ends in .html", hint)
    refuse_taken([path], FLAG, force=force)
    report = read_report(folder)
    bodies = field_bodies(report, folder) + assembly_bodies(folder)
    if not bodies:
        bound = "an output folder with an assembly, or with fields"
        raise validation_error("DIR", str(folder), "", bound, "write one with pipeline run --fields")
    page = render_page("scenes.html.j2", (*FIGURES, *BODIES, "scenes.js"), {"bodies": bodies}, name=report.design.name)
    write_files({path: page.encode()}, FLAG, force=force)
    return path


def assembly_bodies(folder: Path) -> list[Plain]:
    """Return the assembly of an output folder as page data, if it has one."""
    try:
        return [assembly_body(folder)]
    except ValueError:
        return []


def field_bodies(report: Report, folder: Path) -> list[Plain]:
    """Return each scene of an output folder coloured by each of its fields; empty without fields."""
    return [_coloured(scene, field) for scene in field_scenes(report, folder) for field in scene.fields]


def _coloured(scene: FieldPicture, field: Field) -> Plain:
    """Return a scene coloured by a field as page data, which its animation deforms."""
    at_rest, _ = deformed_surface(scene, subdivision=0)
    surface = at_rest.triangulate()
    low, high = field.range_on(scene.mesh)
    scale = ColourScale(label=field.title, low=low, high=high)
    body = GlbBody(
        name=scene.name,
        vertices=np.asarray(surface.points, dtype=np.float64),
        triangles=surface.regular_faces,
        colour=scale.colours(np.asarray(surface.point_data[field.array], dtype=np.float64)),
        moved=scene.factor * np.asarray(surface.point_data[DISPLACEMENT], dtype=np.float64),
    )
    return field_body(f"{scene.name}: {field.title}", body, scale, f"{scene.caption}.")
