"""A self-contained web page that shows the bodies of an output folder and their fields."""

from pathlib import Path

import numpy as np

from cad.files.glb import GlbBody
from pipeline.report.page.page_bodies import ColourScale, assembly_body, field_body
from pipeline.report.page.page_template import BODIES, FIGURES, render_page
from pipeline.report.report import Report, read_report
from pipeline.storage.files import check_paths_are_free, write_files
from pipeline.storage.plain import Plain
from pipeline.view.field_picture import DISPLACEMENT, Field, FieldPicture, deformed_surface
from pipeline.view.scenes import field_scenes
from sensor.quantity import validation_error

FLAG = "--html"


def write_web_page(folder: Path, path: Path, *, force: bool = False) -> Path:
    """Write a web page that shows the bodies of an output folder and their fields, and return its path.

    With `force`, a foreign or changed file at this path is kept as NAME.bak. Raises InputError if there is such a file
    and `force` is false. InputError is also raised if the path does not end in .html, if it cannot be written, or if
    the output folder has no body.
    """
    if path.suffix != ".html":
        hint = f"write {path.with_suffix('.html').name}"
        raise validation_error(FLAG, str(path), "", "a file name that ends in .html", hint)
    check_paths_are_free([path], FLAG, force=force)
    report = read_report(folder)
    bodies = field_bodies(report, folder) + assembly_bodies(folder)
    if not bodies:
        bound = "an output folder with an assembly, or with fields"
        raise validation_error("DIR", str(folder), "", bound, "write one with pipeline run --fields")
    # The scripts are embedded in the page, so that it needs no other file.
    page = render_page("scenes.html.j2", (*FIGURES, *BODIES, "scenes.js"), {"bodies": bodies}, name=report.design.name)
    write_files({path: page.encode()}, FLAG, force=force)
    return path


def assembly_bodies(folder: Path) -> list[Plain]:
    """Return the assembly of an output folder as page data, or an empty list if the folder has no assembly."""
    try:
        return [assembly_body(folder)]
    except ValueError:  # the folder has no readable assembly
        return []


def field_bodies(report: Report, folder: Path) -> list[Plain]:
    """Return the scenes of an output folder as page data: one body for each scene and each field that colours it."""
    return [_colour_scene(scene, field) for scene in field_scenes(report, folder) for field in scene.fields]


def _colour_scene(scene: FieldPicture, field: Field) -> Plain:
    """Return a scene coloured by a field as page data, with the displacements for its animation.

    The displacements are enlarged by the same factor as in the picture.
    """
    undeformed, _ = deformed_surface(scene, subdivision=0)  # coarse facets keep the page small
    surface = undeformed.triangulate()
    low, high = field.range_on(scene.mesh)
    scale = ColourScale(label=field.title, low=low, high=high)
    body = GlbBody(
        name=scene.name,
        vertices=np.asarray(surface.points, dtype=np.float64),
        triangles=surface.regular_faces,
        colour=scale.colours(np.asarray(surface.point_data[field.array], dtype=np.float64)),
        displacement=scene.factor * np.asarray(surface.point_data[DISPLACEMENT], dtype=np.float64),
    )
    return field_body(f"{scene.name}: {field.title}", body, scale, f"{scene.caption}.")
