"""Pictures of an output folder in PyVista: the printed part, every mesh with its fields, and the response P over E."""

import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from cad.design.parameters import Design
from cad.design.tips import Tips
from cad.quantity import fault
from pipeline.report.stored import read_report
from pipeline.storage.placed_files import place_files, refuse_taken
from pipeline.view.response_chart import response_chart

Scene = Any  # a PyVista plotter, or what it draws: its decorated methods have no types that strict mode takes
Draw = Callable[[Scene], None]

DISPLACEMENT, STRESS, STRAIN = "displacement_mm", "von_mises_MPa", "largest_principal_strain"
_PLACE = "_largest_strain_place"
_FLAG = "--png"
_SIZE = (1600, 1000)
_BODY, _EDGE, _ACCENT = "#c8ccd2", "#30343a", "#c0392b"
_IN_FRONT = (-2.0, -2.0)  # of the body that a named boundary lies on: factor and units of the depth
_COLOURS = "YlOrRd"  # pale where there is little stress: the shape stays readable
_DRAWN = 0.08  # largest displacement as drawn, as a share of the part's diagonal
_FACETS = 3  # how often the facet of a quadratic cell is halved
_SHARP = 25.0  # degrees between two facets that make an edge worth a line
_NEAR = 1e-4  # mm, the digits of an STL file


@dataclass(frozen=True, kw_only=True)
class Picture:
    """One picture: its file name without ending, and what draws it."""

    name: str
    draw: Draw


def pictures(folder: Path) -> list[Picture]:
    """Return the pictures of an output folder: housing, one for each VTU file, response; raises InputError."""
    report = read_report(folder)
    shown = []
    if (folder / "housing.stl").is_file():
        shown.append(Picture(name="housing", draw=_housing(folder / "housing.stl", report.design)))
    shown += [Picture(name=path.stem, draw=_field(path)) for path in sorted(folder.glob("*.vtu"))]
    if report.response:
        shown.append(Picture(name="response", draw=response_chart(report)))
    if not shown:
        bound = "an output folder with a housing.stl, a .vtu file or a response to show"
        raise fault("DIR", str(folder), "", bound, "write one with pipeline run")
    return shown


def write_pictures(shown: list[Picture], folder: Path, *, force: bool = False) -> list[Path]:
    """Write each picture as NAME.png into a folder, whole or not at all; return the paths.

    Raises InputError where the folder cannot be written, or has other files of these names and `force` does not keep
    them as NAME.bak.
    """
    if not force:
        refuse_taken(folder, [f"{picture.name}.png" for picture in shown], _FLAG)
    if not os.environ.get("DISPLAY") and not os.environ.get("WAYLAND_DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    with tempfile.TemporaryDirectory(prefix="twintip-") as unfinished:
        files = {f"{picture.name}.png": _drawn(picture, Path(unfinished)) for picture in shown}
    return place_files(folder, files, _FLAG, force=force)


def _drawn(picture: Picture, folder: Path) -> bytes:
    """Return a picture as the bytes of a PNG file, for which a folder is used."""
    plotter: Scene = pv.Plotter(off_screen=True, window_size=list(_SIZE))
    try:
        plotter.set_background("white")
        picture.draw(plotter)
        path = folder / f"{picture.name}.png"
        plotter.screenshot(path)
    finally:
        plotter.close()
    return path.read_bytes()


def show_pictures(shown: list[Picture], name: str) -> None:
    """Show every picture in one window; raises InputError where no window can open."""
    if sys.platform == "linux" and not os.environ.get("DISPLAY") and not os.environ.get("WAYLAND_DISPLAY"):
        raise fault("display", None, "", "one that can open a window", "write pictures instead: --png DIR")
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    plotter: Scene = pv.Plotter(shape=(rows, columns), title=f"twintip: {name}", window_size=list(_SIZE))
    for index, picture in enumerate(shown):
        plotter.subplot(index // columns, index % columns)
        plotter.set_background("white")
        picture.draw(plotter)
    plotter.show()


def _light(plotter: Scene) -> None:
    """Light a part from the eye and from both sides, so that walls in the shade still show their shape."""
    plotter.remove_all_lights()
    for place, strength in (((0.2, 0.3, 1.0), 0.75), ((-1.0, 0.4, 0.6), 0.35), ((1.0, -0.6, 0.4), 0.25)):
        plotter.add_light(pv.Light(position=place, intensity=strength, light_type="camera light"))
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_parallel_projection()


def _read(path: Path) -> Scene:
    """Return what a file holds; raises InputError when it holds nothing."""
    data = pv.read(path)
    if not getattr(data, "n_cells", 0):
        raise fault("file", str(path), "", "a mesh with at least one cell", "write it again with pipeline run")
    return data


def _title(plotter: Scene, text: str) -> None:
    plotter.add_text(text, position="upper_edge", font_size=11, color="black")


def _housing(path: Path, design: Design) -> Draw:
    def draw(plotter: Scene) -> None:
        part = _read(path)
        _light(plotter)
        plotter.add_mesh(part, color=_BODY, smooth_shading=True, split_sharp_edges=True, ambient=0.15)
        plotter.add_mesh(_sharp_edges(part), color=_EDGE, line_width=2)
        tips = tip_points(np.asarray(part.points), design.tips)
        if tips is not None:
            away = tips - np.asarray(part.center)
            away[:, 0] = 0.0
            places = tips + 0.25 * away
            plotter.add_point_labels(
                places, ["L", "H"], font_size=34, text_color=_ACCENT, shape=None, always_visible=True, show_points=False
            )
        size = " x ".join(f"{length:.1f}" for length in np.ptp(np.asarray(part.points), axis=0))
        _title(plotter, f"{design.name}: housing, {size} mm; L low spring, H high spring")
        _look(plotter, (0.35, -0.75, 1.0), part)

    return draw


def tip_points(points: np.ndarray[Any, Any], tips: Tips) -> np.ndarray[Any, Any] | None:
    """Return the centres of the low and the high tip face, shape (2, 3) [mm], or None where the part shows none.

    The tips are the only faces at one end of the part, and they span spacing plus side along x.
    """
    side, spacing = tips.side_mm, tips.spacing_mm
    for axis in (1, 2):
        for end in (points[:, axis].min(), points[:, axis].max()):
            face = points[np.abs(points[:, axis] - end) < _NEAR]
            x = face[:, 0]
            if abs(np.ptp(x) - spacing - side) < 10.0 * _NEAR:
                halves = (face[x < x.mean()], face[x > x.mean()])
                return np.array([0.5 * (half.min(axis=0) + half.max(axis=0)) for half in halves])
    return None


def _field(path: Path) -> Draw:
    def draw(plotter: Scene) -> None:
        mesh = _read(path)
        _light(plotter)
        if {DISPLACEMENT, STRESS} <= set(mesh.point_data.keys()):
            _draw_deformed(plotter, mesh, path.stem)
        else:
            _draw_mesh(plotter, mesh, path.stem)
        _look(plotter, (0.25, -1.0, 0.45), mesh)

    return draw


def _draw_deformed(plotter: Scene, mesh: Scene, name: str) -> None:
    largest = float(np.linalg.norm(mesh.point_data[DISPLACEMENT], axis=1).max())
    factor = deformation_factor(largest, float(mesh.length))
    surface = mesh.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=_FACETS)
    moved = surface.warp_by_vector(DISPLACEMENT, factor=factor)
    bar = {"title": "von Mises stress [MPa]\n", "color": "black", "fmt": "%.3g", "n_labels": 5, "vertical": False}
    bar |= {"position_x": 0.25, "position_y": 0.04, "width": 0.5, "height": 0.08}
    plotter.add_mesh(_sharp_edges(surface), color=_EDGE, line_width=1, opacity=0.5)
    limits = [0.0, float(moved.point_data[STRESS].max())]  # between nodes a quadratic cell may dip below zero
    plotter.add_mesh(moved, scalars=STRESS, clim=limits, cmap=_COLOURS, ambient=0.35, scalar_bar_args=bar)
    plotter.add_mesh(_sharp_edges(moved), color=_EDGE, line_width=2)
    _label_strains(plotter, mesh, factor)
    _title(plotter, f"{name}: deformation drawn {factor:g} times; largest displacement {largest:.3g} mm")


def _label_strains(plotter: Scene, mesh: Scene, factor: float) -> None:
    """Write the largest strain of each spring's leaves where it is."""
    names = [key for key in mesh.point_data if key.endswith(_PLACE)]
    if names:
        nodes = [int(np.argmax(mesh.point_data[key])) for key in names]
        places = np.asarray(mesh.points)[nodes] + factor * mesh.point_data[DISPLACEMENT][nodes]
        labels = [f"strain {mesh.point_data[STRAIN][node]:.2%}" for node in nodes]
        plotter.add_point_labels(
            places, labels, font_size=20, text_color=_ACCENT, point_color=_ACCENT, shape=None, always_visible=True
        )


def _sharp_edges(surface: Scene) -> Scene:
    return surface.extract_feature_edges(
        feature_angle=_SHARP, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )


def deformation_factor(largest_mm: float, length_mm: float) -> float:
    """Return by how much displacements are drawn larger [1]: 1, or 1, 2 or 5 times a power of ten."""
    wanted = _DRAWN * length_mm / largest_mm if largest_mm > 0.0 else 1.0
    if wanted <= 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted * (1.0 + 1e-12)))


def _draw_mesh(plotter: Scene, mesh: Scene, name: str) -> None:
    """Draw a mesh without fields, its named boundaries in colour."""
    plotter.add_mesh(mesh, color=_BODY, ambient=0.15, show_edges=True, edge_color=_EDGE, line_width=1)
    names = sorted(key for key in mesh.point_data if np.isin(mesh.point_data[key], (0, 1)).all())
    surface = mesh.extract_surface(algorithm="dataset_surface")
    colours = ("#c0392b", "#2471a3", "#229954", "#b7950b", "#7d3c98", "#117a65")
    labels = []
    for key, colour in zip(names, colours, strict=False):
        whole = surface.extract_points(surface.point_data[key] == 1, adjacent_cells=False)
        if whole.n_cells:
            actor = plotter.add_mesh(whole, color=colour, show_edges=True, line_width=1)
            actor.mapper.resolve = "polygon_offset"
            actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(*_IN_FRONT)
            labels.append([key, colour])
    if labels:
        plotter.add_legend(labels, bcolor="white", border=False, face="rectangle", size=(0.2, 0.04 * len(labels)))
    _title(plotter, f"{name}: {mesh.n_cells} cells, {mesh.n_points} points")


def _look(plotter: Scene, direction: tuple[float, float, float], mesh: Scene) -> None:
    """Look at a part from a direction, from far enough to see all of it."""
    centre = np.asarray(mesh.center)
    plotter.camera_position = [tuple(centre + mesh.length * np.asarray(direction)), tuple(centre), (0.0, 0.0, 1.0)]
    plotter.reset_camera()
    plotter.camera.zoom(1.25)
