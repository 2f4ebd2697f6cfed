"""What every picture has around its body: light, a title, a rule for the size, and the eye."""

import math
import textwrap
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes
Plotter = Any
Vector = tuple[float, float, float]
Box = tuple[Vector, Vector]
Corner = NDArray[np.float64]

BODY, EDGE, ACCENT = "#c8ccd2", "#30343a", "#c0392b"
_SHARP = 25.0  # degrees between two facets that make an edge worth a line
_RULE = 0.25  # of the width of a body, at most
_BELOW = 0.06  # of the size of a body, how far below it the rule lies
_UP = (0.0, 0.0, 1.0)
_LARGEST_LETTERS, _SMALLEST_LETTERS, _FULL_WIDTH = 11, 7, 1600  # of a title, and where they are the largest
_LETTER = 1.35  # width of a letter over its size
_TOP, _BOTTOM, _SIDES = 0.12, 0.24, 0.9  # of the picture: room for the title, for rule and bar, and what is filled


def light_body(plotter: Plotter) -> None:
    """Light a part from the eye and from both sides, so that walls in the shade still show their shape."""
    plotter.remove_all_lights()
    for place, strength in (((0.2, 0.3, 1.0), 0.75), ((-1.0, 0.4, 0.6), 0.35), ((1.0, -0.6, 0.4), 0.25)):
        plotter.add_light(pv.Light(position=place, intensity=strength, light_type="camera light"))
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_parallel_projection()


def add_title(plotter: Plotter, text: str) -> None:
    """Write a title above a body, in as many lines as the width of the picture asks for."""
    width, _ = picture_size(plotter)
    size = min(_LARGEST_LETTERS, max(_SMALLEST_LETTERS, round(_LARGEST_LETTERS * width / _FULL_WIDTH)))
    lines = textwrap.wrap(text, max(1, int(width / (_LETTER * size))))
    plotter.add_text("\n".join(lines), position="upper_edge", font_size=size, color="black")


def picture_size(plotter: Plotter) -> tuple[int, int]:
    """Return the width and height of what is drawn in [pixels]: the window, or its part that is being filled."""
    width, height = plotter.window_size
    left, bottom, right, top = plotter.renderer.viewport
    return max(1, round(width * (right - left))), max(1, round(height * (top - bottom)))


def sharp_edges(surface: Mesh) -> Mesh:
    """Return the lines along which a surface has an edge."""
    return surface.extract_feature_edges(
        feature_angle=_SHARP, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )


def rule_length(width_mm: float) -> float:
    """Return 1, 2 or 5 times a power of ten [mm], at most a quarter of a width [mm]."""
    wanted = _RULE * width_mm
    power = 10.0 ** math.floor(math.log10(wanted))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted * (1.0 + 1e-12))


def add_rule(plotter: Plotter, mesh: Mesh, focus: Box | None = None) -> None:
    """Draw a line of a round length along x below the front of a body, its length [mm] beside it."""
    lower, upper = np.array(focus) if focus else np.array(mesh.bounds).reshape(3, 2).T
    length = rule_length(upper[0] - lower[0])
    start = np.array([lower[0], lower[1], lower[2] - _BELOW * float(np.linalg.norm(upper - lower))])
    along, up = np.array([length, 0.0, 0.0]), np.array([0.0, 0.0, 0.06 * length])
    end = start + along
    plotter.add_mesh(pv.Line(start, end), color=EDGE, line_width=4)
    for tick in (start, end):
        plotter.add_mesh(pv.Line(tick, tick + up), color=EDGE, line_width=3)
    add_labels(plotter, [start - 4.0 * up], [f"{length:g} mm"], EDGE)


def add_labels(plotter: Plotter, places: Any, texts: list[str], colour: str = ACCENT, size: int = 20) -> None:  # noqa: ANN401
    """Write texts at places, shape (texts, 3) [mm], over whatever lies before them."""
    plotter.add_point_labels(
        np.asarray(places, dtype=np.float64),
        texts,
        font_size=size,
        text_color=colour,
        shape="rounded_rect",
        shape_color="white",
        shape_opacity=0.75,
        margin=1,
        always_visible=True,
        show_points=False,
    )


def look_at(plotter: Plotter, direction: Vector, mesh: Mesh, focus: Box | None = None) -> None:
    """Look at a body from a direction, from far enough to see all of it, or all of a box [mm] within it."""
    lower, upper = np.array(focus) if focus else np.array(mesh.bounds).reshape(3, 2).T
    centre = 0.5 * (lower + upper)
    plotter.camera_position = [tuple(centre + 3.0 * mesh.length * np.asarray(direction)), tuple(centre), _UP]
    plotter.reset_camera(bounds=[bound for ends in zip(lower, upper, strict=True) for bound in ends])
    _leave_margins(plotter, lower, upper)
    plotter.camera.clipping_range = (1e-3 * mesh.length, 20.0 * mesh.length)


def _leave_margins(plotter: Plotter, lower: Corner, upper: Corner) -> None:
    """Let a box [mm] fill the picture but for the room of title, rule and bar of colours."""
    camera = plotter.camera
    right, upward = _picture_axes(camera)
    corners = np.stack(np.meshgrid(*zip(lower, upper, strict=True)), axis=-1).reshape(-1, 3)
    across, along = corners @ right, corners @ upward
    width, height = picture_size(plotter)
    scale = 0.5 * max(np.ptp(along) / (1.0 - _TOP - _BOTTOM), np.ptp(across) * height / width / _SIDES)
    eye = np.array(camera.focal_point)
    shift = (_middle(across) - eye @ right) * right
    shift += (_middle(along) - scale * (_BOTTOM - _TOP) - eye @ upward) * upward
    camera.position, camera.focal_point = tuple(camera.position + shift), tuple(eye + shift)
    camera.parallel_scale = scale


def _middle(places: Corner) -> float:
    return 0.5 * float(places.max() + places.min())


def _picture_axes(camera: Any) -> tuple[Corner, Corner]:  # noqa: ANN401 - of PyVista
    """Return the directions to the right of the picture and upwards in it [1]."""
    view = np.array(camera.direction) / np.linalg.norm(camera.direction)
    right = np.cross(view, _UP) / np.linalg.norm(np.cross(view, _UP))
    return right, np.cross(right, view)
