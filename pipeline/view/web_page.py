"""The scenes of an output folder in one web page that needs nothing else: vtk.js, drawn by the browser."""

import base64
import io
import json
import re
import zipfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
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
from pipeline.report.stored import read_report
from pipeline.storage.placed_files import place_file, refuse_taken
from pipeline.view.pictures import draw_without_display, field_scenes
from pipeline.view.scenes.assembly import assembly, draw_bodies
from pipeline.view.scenes.field import Field
from pipeline.view.scenes.scene import COLOURS, FieldScene, draw_body
from pipeline.view.scenes.stage import light_body, look_at

Plotter = Any  # a PyVista plotter: its decorated methods have no types that strict mode takes

FLAG = "--html"
_TEMPLATE = "scenes.html.j2"
_FACETS = 1  # how often the facet of a quadratic cell is halved: the page is to stay small
_SHADES = 12
_ICONS = b"https://kitware.github.io/vtk-js/icon/"
_DATE = (1980, 1, 1, 0, 0, 0)  # of every file in an archive: the same bytes every time
_ADDRESS = re.compile(r"(?<=[\"{])[0-9a-f]{16}(?=[\"}-])")  # of an object, in its name and where it is named
_LOOK = (0.55, -1.0, 0.5)


@dataclass(frozen=True, kw_only=True)
class WebScene:
    """A scene of the page: its label and title, the field with the ends of its colours as text, the body as data."""

    label: str
    title: str
    field: str | None
    least: str | None
    largest: str | None
    data: str


def write_web_page(folder: Path, path: Path, *, force: bool = False) -> Path:
    """Write the scenes of an output folder as one web page; return its path.

    Raises InputError where the folder has no scene, the path ends in another way than .html or cannot be written, or a
    foreign file is there and `force` does not keep it as NAME.bak.
    """
    if path.suffix != ".html":
        raise validation_error(
            FLAG, str(path), "", "a file name that ends in .html", f"write {path.with_suffix('.html').name}"
        )
    if not force:
        refuse_taken(path.parent, [path.name], FLAG, file=path)
    return place_file(path, web_page(folder), FLAG, force=force)


def web_page(folder: Path) -> bytes:
    """Return the page of an output folder; raises InputError where it has no scene."""
    draw_without_display()
    name = read_report(folder).design.name
    scenes = [asdict(scene) for scene in _web_scenes(folder)]
    if not scenes:
        bound = "an output folder with a housing, or with fields"
        raise validation_error("DIR", str(folder), "", bound, "write one with pipeline run --fields")
    templates = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=select_autoescape(["j2"]))
    page = templates.get_template(_TEMPLATE).render(
        name=name,
        scenes=scenes,
        viewer=base64.b64encode(_viewer()).decode(),
        colours=[mpl.colors.to_hex(mpl.colormaps[COLOURS](shade / (_SHADES - 1))) for shade in range(_SHADES)],
    )
    return page.encode()


def _viewer() -> bytes:
    """Return the page that draws one scene, its icons, which it would ask of the network, left out."""
    page: bytes = HTML_VIEWER_PATH.read_bytes()
    return page.replace(_ICONS, b"data:,")


def _web_scenes(folder: Path) -> Iterator[WebScene]:
    """Yield each scene with each of its fields, then the assembly."""
    report = read_report(folder)
    for scene in field_scenes(report, folder):
        for field in scene.fields:
            yield _field_scene(scene, field)
    bodies = assembly(report)
    if bodies:
        plotter: Plotter = pv.Plotter(off_screen=True)
        light_body(plotter)
        draw_bodies(plotter, bodies)
        look_at(plotter, _LOOK, pv.merge([body.surface for body in bodies]))
        title = f"{report.design.name}: the sensor over its fruit"
        yield WebScene(label="assembly", title=title, field=None, least=None, largest=None, data=_archived(plotter))


def _field_scene(scene: FieldScene, field: Field) -> WebScene:
    plotter: Plotter = pv.Plotter(off_screen=True)
    draw_body(plotter, scene, field, facets=_FACETS)
    look_at(plotter, scene.direction, scene.mesh, scene.focus)
    least, largest = field.range_on(scene.mesh)
    return WebScene(
        label=f"{scene.name}: {field.title}",
        title=scene.caption,
        field=field.title,
        least=f"{least:.3g}",
        largest=f"{largest:.3g}",
        data=_archived(plotter),
    )


def _archived(plotter: Plotter) -> str:
    """Return what a plotter draws as vtk.js reads it, an archive in base 64, and close the plotter."""
    initialize_serializers()
    configure_serializer(encode_lut=True, skip_light=True)
    plotter.render()
    window, context = plotter.render_window, SynchronizationContext()
    context.set_ignore_last_dependencies(True)
    state = serialize(None, window, reference_id(window), context, 1)
    camera = plotter.camera
    state["mtime"] = 1  # else it counts all that this process has drawn
    state["extra"] = {
        "vtkRefId": reference_id(window),
        "centerOfRotation": list(camera.focal_point),
        "camera": reference_id(camera),
    }
    arrays = {
        entry["hash"]: {**entry, "content": context.get_cached_data_array(entry["hash"], False)}  # noqa: FBT003
        for entry in extract_array_hash(state)
    }
    text = json.dumps({"hashes": arrays, "scene": _numbered(state)}, sort_keys=True)
    plotter.close()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr(zipfile.ZipInfo("index.json", _DATE), text, zipfile.ZIP_DEFLATED)
    return base64.b64encode(packed.getvalue()).decode()


def _numbered(state: object) -> object:
    """Return a scene whose objects are named by numbers, not by their addresses, which are others every time."""
    text = json.dumps(state, sort_keys=True)
    numbers = {name: number for number, name in enumerate(dict.fromkeys(_ADDRESS.findall(text)), start=1)}
    return json.loads(_ADDRESS.sub(lambda found: f"{numbers[found[0]]:016x}", text))
