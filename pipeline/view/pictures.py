"""Pictures of an output folder: the printed part, the assembly, every scene with its fields, and the response."""

import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pyvista as pv

from cad.quantity import validation_error
from pipeline.report.stored import StoredReport, read_report
from pipeline.storage.placed_files import place_files, refuse_taken
from pipeline.view.printed_part import draw_printed_part
from pipeline.view.response_chart import draw_response_chart
from pipeline.view.scenes.assembly import assembly, draw_assembly, drawn_apart
from pipeline.view.scenes.field import SHARE_OF_LIMIT, VERTICAL_PRESSURE
from pipeline.view.scenes.flexures import flexure_scenes
from pipeline.view.scenes.fruit import fruit_scene
from pipeline.view.scenes.mirrored import whole_model
from pipeline.view.scenes.scene import FieldScene, draw_plain, draw_scene

Plotter = Any  # a PyVista plotter: its decorated methods have no types that strict mode takes
Draw = Callable[[Plotter], None]

FLAG = "--png"
SIZE = (1600, 1000)
_FLEXURE, _FRUIT = "flexure.vtu", "fruit.vtu"
_FEWEST_APART = 2  # a housing and its fruit stand apart as they are


@dataclass(frozen=True, kw_only=True)
class Picture:
    """One picture: its file name without ending, and what draws it; `in_window` says that it has a place there."""

    name: str
    draw: Draw
    in_window: bool = True


def pictures(folder: Path) -> list[Picture]:
    """Return the pictures of an output folder: part, assembly, flexures, fruit, response; raises InputError."""
    report = read_report(folder)
    shown = []
    if (folder / "housing.stl").is_file():
        part = read_mesh(folder / "housing.stl")
        shown.append(Picture(name="housing", draw=partial(draw_printed_part, part=part, design=report.design)))
    shown += _assembly_pictures(report) + _field_pictures(field_scenes(report, folder)) + _mesh_pictures(folder)
    if report.response:
        shown.append(Picture(name="response", draw=partial(draw_response_chart, report=report)))
    if not shown:
        bound = "an output folder with a housing.stl, a .vtu file or a response to show"
        raise validation_error("DIR", str(folder), "", bound, "write one with pipeline run")
    return shown


def field_scenes(report: StoredReport, folder: Path) -> tuple[FieldScene, ...]:
    """Return the scenes of a folder that have fields: the low and the high spring, the fruit; raises InputError."""
    scenes: list[FieldScene | None] = []
    if (folder / _FLEXURE).is_file():
        scenes += flexure_scenes(report, read_mesh(folder / _FLEXURE))
    if (folder / _FRUIT).is_file():
        scenes.append(fruit_scene(report.design, read_mesh(folder / _FRUIT)))
    return tuple(scene for scene in scenes if scene is not None)


def read_mesh(path: Path) -> Any:  # noqa: ANN401 - a PyVista data set
    """Return what a file holds; raises InputError when it holds nothing."""
    data = pv.read(path)
    if not getattr(data, "n_cells", 0):
        raise validation_error(
            "file", str(path), "", "a mesh with at least one cell", "write it again with pipeline run"
        )
    return data


def _assembly_pictures(report: StoredReport) -> list[Picture]:
    bodies = assembly(report)
    if not bodies:
        return []
    name = report.design.name
    whole = partial(draw_assembly, bodies=bodies, title=f"{name}: the sensor over its fruit")
    drawn = [Picture(name="assembly", draw=whole)]
    if len(bodies) <= _FEWEST_APART:
        return drawn
    apart = partial(draw_assembly, bodies=drawn_apart(bodies), title=f"{name}: drawn apart", named=True)
    return [*drawn, Picture(name="exploded", draw=apart, in_window=False)]


def _field_pictures(scenes: tuple[FieldScene, ...]) -> list[Picture]:
    """Return a picture of the first field of each scene, and one of what limits it or is pressed into it."""
    shown = []
    for scene in scenes:
        shown.append(Picture(name=scene.name, draw=partial(draw_scene, scene=scene)))
        for field, name in ((SHARE_OF_LIMIT, "limit"), (VERTICAL_PRESSURE, "pressure")):
            if field in scene.fields[1:]:
                draw = partial(draw_scene, scene=scene, field=field)
                shown.append(Picture(name=f"{scene.name}-{name}", draw=draw, in_window=False))
    return shown


def _mesh_pictures(folder: Path) -> list[Picture]:
    """Return a picture of the mesh of the flexures: the cells that were solved."""
    path = folder / _FLEXURE
    if not path.is_file():
        return []
    mesh = whole_model(read_mesh(path))
    title = f"mesh of the housing: {mesh.n_cells} cells, {mesh.n_points} points with the mirrored half"
    return [Picture(name="mesh", draw=partial(draw_plain, mesh=mesh, title=title), in_window=False)]


def write_pictures(shown: list[Picture], folder: Path, *, force: bool = False) -> list[Path]:
    """Write each picture as NAME.png into a folder, whole or not at all; return the paths.

    Raises InputError where the folder cannot be written, or has other files of these names and `force` does not keep
    them as NAME.bak.
    """
    if not force:
        refuse_taken(folder, [f"{picture.name}.png" for picture in shown], FLAG)
    draw_without_display()
    with tempfile.TemporaryDirectory(prefix="twintip-") as unfinished:
        files = {f"{picture.name}.png": _drawn(picture, Path(unfinished)) for picture in shown}
    return place_files(folder, files, FLAG, force=force)


def draw_without_display() -> None:
    """Let VTK draw off screen where there is no display; called before the first plotter is made."""
    if not os.environ.get("DISPLAY") and not os.environ.get("WAYLAND_DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")


def _drawn(picture: Picture, folder: Path) -> bytes:
    """Return a picture as the bytes of a PNG file, for which a folder is used."""
    plotter: Plotter = pv.Plotter(off_screen=True, window_size=list(SIZE))
    try:
        plotter.set_background("white")
        picture.draw(plotter)
        path = folder / f"{picture.name}.png"
        plotter.screenshot(path)
    finally:
        plotter.close()
    return path.read_bytes()
