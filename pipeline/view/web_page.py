"""The scenes of an output folder in one web page that needs nothing else: vtk.js, drawn by the browser."""

import base64
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pyvista as pv
from jinja2 import Environment, FileSystemLoader, select_autoescape
from trame_vtk.modules.vtk.serializers import (
    SynchronizationContext,
    configure_serializer,
    extract_array_hash,
    initialize_serializers,
    reference_id,
    serialize,
)
from trame_vtk.tools.vtksz2html import HTML_VIEWER_PATH

from cad.quantity import validation_error
from pipeline.report.stored import StoredReport, read_report
from pipeline.storage.files import refuse_taken, write_files
from pipeline.view.pictures import draw_without_display
from pipeline.view.scene import PALETTE, draw_field, look_at
from pipeline.view.scenes import ASSEMBLY_DIRECTION, assembly, draw_bodies, field_scenes

Plotter = Any  # a PyVista plotter: its decorated methods have no types that strict mode takes

FLAG = "--html"
_SUBDIVISION = 1  # how often the facet of a quadratic cell is halved: the page is to stay small
_COLOURS = 12
_ICONS = b"https://kitware.github.io/vtk-js/icon/"


def write_web_page(folder: Path, path: Path, *, force: bool = False) -> Path:
    """Write the scenes of an output folder as one web page; return its path.

    Raises InputError where the folder has no scene, the path ends in another way than .html or cannot be written, or
    an unmanaged file is there and `force` does not keep it as NAME.bak.
    """
    if path.suffix != ".html":
        hint = f"write {path.with_suffix('.html').name}"
        raise validation_error(FLAG, str(path), "", "a file name that ends in .html", hint)
    if not force:
        refuse_taken([path], FLAG, renew=True)
    write_files({path: web_page(folder)}, FLAG, force=force, renew=True)
    return path


def web_page(folder: Path) -> bytes:
    """Return the page of an output folder; raises InputError where it has no scene."""
    draw_without_display()
    report = read_report(folder)
    scenes = _web_scenes(report, folder)
    if not scenes:
        bound = "an output folder with a housing, or with fields"
        raise validation_error("DIR", str(folder), "", bound, "write one with pipeline run --fields")
    viewer = HTML_VIEWER_PATH.read_bytes().replace(_ICONS, b"data:,")  # icons that it would ask of the network
    colours = mpl.colormaps[PALETTE].resampled(_COLOURS)
    templates = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=select_autoescape(["j2"]))
    page = templates.get_template("scenes.html.j2").render(
        name=report.design.name,
        scenes=scenes,
        viewer=base64.b64encode(viewer).decode(),
        colours=[mpl.colors.to_hex(colours(index)) for index in range(_COLOURS)],
    )
    return page.encode()


def _web_scenes(report: StoredReport, folder: Path) -> list[dict[str, str | None]]:
    """Return each scene with each of its fields, then the assembly, as the page's script reads them.

    A scene has its label and title, the body as data, and its field with the ends of its colours as text.
    """
    scenes: list[dict[str, str | None]] = []
    for scene in field_scenes(report, folder):
        for field in scene.fields:
            plotter: Plotter = pv.Plotter(off_screen=True)
            draw_field(plotter, scene, field, subdivision=_SUBDIVISION)
            look_at(plotter, scene.focus or tuple(scene.mesh.bounds), scene.direction)
            lowest, highest = field.range_on(scene.mesh)
            web_scene: dict[str, str | None] = {
                "label": f"{scene.name}: {field.title}",
                "title": scene.caption,
                "data": _archived(plotter),
                "field": field.title,
                "lowest": f"{lowest:.3g}",
                "highest": f"{highest:.3g}",
            }
            scenes.append(web_scene)
    bodies = assembly(report)
    if bodies:
        plotter = pv.Plotter(off_screen=True)
        draw_bodies(plotter, bodies)
        look_at(plotter, tuple(plotter.bounds), ASSEMBLY_DIRECTION)
        title = f"{report.design.name}: the sensor over its fruit"
        no_field = dict.fromkeys(("field", "lowest", "highest"))
        scenes.append({"label": "assembly", "title": title, "data": _archived(plotter), **no_field})
    return scenes


def _archived(plotter: Plotter) -> str:
    """Return what a plotter draws as vtk.js reads it, an archive in base 64, and close the plotter."""
    initialize_serializers()
    configure_serializer(encode_lut=True, skip_light=True)
    plotter.render()
    window = plotter.render_window
    context = SynchronizationContext()
    context.set_ignore_last_dependencies(True)
    state = serialize(None, window, reference_id(window), context, 1)
    camera = plotter.camera
    state["extra"] = {
        "vtkRefId": reference_id(window),
        "centerOfRotation": list(camera.focal_point),
        "camera": reference_id(camera),
    }
    arrays = {}
    for entry in extract_array_hash(state):
        content = context.get_cached_data_array(entry["hash"], binary=False)
        arrays[entry["hash"]] = {**entry, "content": content}
    plotter.close()
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("index.json", json.dumps({"hashes": arrays, "scene": state}))
    return base64.b64encode(archive.getvalue()).decode()
