"""Pictures of an output folder, as files or in a window: part, assembly, mesh, and scenes coloured by fields."""

import math
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from pipeline.making.field_files import FLEXURE
from pipeline.report.report import Report, read_report
from pipeline.storage.files import check_paths_are_free, write_files
from pipeline.storage.stopwatch import Count, ignore_progress
from pipeline.view.field_picture import Vector, draw_cells, draw_part, draw_scene
from pipeline.view.scenes import (
    STRAIN_OVER_LIMIT,
    assembly_parts,
    complete_half_model,
    draw_assembly,
    draw_exploded_view,
    field_scenes,
    read_mesh,
)
from sensor.quantity import validation_error

Plotter = Any  # a PyVista plotter; its decorated methods have no types that mypy's strict mode accepts

FLAG = "--png"
SIZE = (1600, 1000)  # width and height of a picture or a window [pixels]
_PRINTED_DIRECTION = Vector(0.35, -0.75, 1.0)  # from the printed housing to the viewer
_HOUSING_AND_FRUIT = 2  # number of parts of an assembly that consists only of housing and fruit
_MAX_COLUMNS = 3  # largest number of pictures side by side in a window


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture: its file name without the suffix, and the function that draws it on a plotter.

    If `in_window` is false, the picture is only written to a file.
    """

    name: str
    draw: Callable[[Plotter], None]
    in_window: bool = True


def pictures(folder: Path) -> list[Picture]:
    """Return the pictures of an output folder: part, assembly, exploded view, flexures, fruit and mesh.

    A picture is omitted if the folder does not have the files for it. Raises InputError if there is no picture.
    """
    report = read_report(folder)
    all_pictures = [*_solid_pictures(report, folder), *_field_pictures(report, folder)]
    if not all_pictures:
        bound = "an output folder with a housing.stl or a .vtu file to show"
        raise validation_error("DIR", str(folder), "", bound, "write one with pipeline run --fields")
    return all_pictures


def _solid_pictures(report: Report, folder: Path) -> Iterator[Picture]:
    """Yield the pictures of the solids: the housing in print pose, the assembly, and its exploded view.

    The exploded view is omitted if the assembly has only a housing and a fruit.
    """
    if (folder / "housing.stl").is_file():
        part = read_mesh(folder / "housing.stl")
        # The bounds of VTK are minimum and maximum x, then y, then z.
        length, width, height = np.ptp(np.reshape(part.bounds, (3, 2)), axis=1)
        title = f"{report.design.name}: housing as printed, {length:.1f} x {width:.1f} x {height:.1f} mm"
        draw = partial(draw_part, part=part, title=title, direction=_PRINTED_DIRECTION)
        yield Picture(name="housing", draw=draw)
    parts = assembly_parts(report)
    if parts:
        title = f"{report.design.name}: the sensor over its fruit"
        yield Picture(name="assembly", draw=partial(draw_assembly, parts=parts, title=title))
    if len(parts) > _HOUSING_AND_FRUIT:
        draw = partial(draw_exploded_view, parts=parts, title=f"{report.design.name}: exploded view")
        yield Picture(name="exploded", draw=draw, in_window=False)


def _field_pictures(report: Report, folder: Path) -> Iterator[Picture]:
    """Yield the pictures of the scenes, which are coloured by fields, and a picture of the mesh of the housing.

    Each scene is coloured by its default field. A scene with the strain divided by its limit is drawn a second time,
    coloured by this field.
    """
    for scene in field_scenes(report, folder):
        yield Picture(name=scene.name, draw=partial(draw_scene, scene=scene))
        if STRAIN_OVER_LIMIT in scene.fields:
            draw = partial(draw_scene, scene=scene, field=STRAIN_OVER_LIMIT)
            yield Picture(name=f"{scene.name}-limit", draw=draw, in_window=False)
    if (folder / FLEXURE).is_file():
        mesh = complete_half_model(read_mesh(folder / FLEXURE))
        title = f"mesh of the housing: {mesh.n_cells} cells, {mesh.n_points} points with the mirrored half"
        yield Picture(name="mesh", draw=partial(draw_cells, mesh=mesh, title=title), in_window=False)


def write_pictures(
    all_pictures: list[Picture], folder: Path, *, force: bool = False, count: Count = ignore_progress
) -> list[Path]:
    """Write each picture to a folder as NAME.png, and return the paths. Either all pictures are written or none.

    `count` is called with the number of finished pictures and the number of all pictures. With `force`, an existing
    file that this program did not write, or that was changed since, is kept as NAME.bak. Raises InputError if there is
    such a file and `force` is false, or if the folder cannot be written.
    """
    check_paths_are_free([folder / f"{picture.name}.png" for picture in all_pictures], FLAG, force=force)
    draw_without_display()
    files = {}  # content of each file, keyed by its path
    # The plotter can only write to a file. In a temporary folder, an interrupted run leaves no pictures behind.
    with tempfile.TemporaryDirectory(prefix="twintip-") as temporary_folder:
        for number, picture in enumerate(all_pictures):
            count(number, len(all_pictures))
            path = Path(temporary_folder) / f"{picture.name}.png"
            plotter: Plotter = pv.Plotter(off_screen=True, window_size=list(SIZE))
            try:
                plotter.set_background("white")
                picture.draw(plotter)
                plotter.screenshot(path)
            finally:
                plotter.close()
            files[folder / path.name] = path.read_bytes()
    return write_files(files, FLAG, force=force)


def show_pictures(all_pictures: list[Picture], name: str) -> None:
    """Show the pictures in one window until it is closed. Raises InputError if no window can be opened."""
    if sys.platform == "linux" and not _has_display():
        raise validation_error("display", None, "", "one that can open a window", "write pictures instead: --png DIR")
    window_of(all_pictures, name).show()


def window_of(all_pictures: list[Picture], name: str) -> Plotter:
    """Return a window in which the pictures are drawn in rows. The window is not yet open."""
    shown_pictures = [picture for picture in all_pictures if picture.in_window]
    columns = min(_MAX_COLUMNS, len(shown_pictures))
    rows = math.ceil(len(shown_pictures) / columns)
    plotter: Plotter = pv.Plotter(shape=(rows, columns), title=f"twintip: {name}", window_size=list(SIZE))
    for index, picture in enumerate(shown_pictures):
        plotter.subplot(index // columns, index % columns)
        plotter.set_background("white")
        picture.draw(plotter)
    return plotter


def draw_without_display() -> None:
    """Let VTK draw off screen if there is no display. Call this function before the first plotter is created."""
    if not _has_display():
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")


def _has_display() -> bool:
    """Return whether the environment declares an X11 or Wayland display."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
