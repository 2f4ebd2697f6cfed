"""Bodies seen from one side, without hidden parts, drawn by a depth buffer in NumPy: no window, no graphics driver."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.report.page.drawing.raster import FINE, frontmost, reduced

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Pixels = NDArray[np.uint8]

_LIGHT = np.array([-0.35, -0.75, 0.95])
_AMBIENT = 0.42
_FOLD = 0.92  # cosine between neighbouring faces below which an edge is drawn
_STEP = 1.2  # [mm] of depth between neighbouring pixels that is another body part behind
_DARK = (0.10, 0.11, 0.13)  # of edges


@dataclass(frozen=True, kw_only=True, eq=False)
class Facets:
    """A body as triangles: corners, shape (triangles, 3 corners, 3) [mm], and its colour (red, green, blue, 0 to 1)."""

    name: str
    corners: Floats
    colour: tuple[float, float, float]

    def moved(self, x: float, y: float, z: float) -> "Facets":
        """Return the body moved by a way [mm]."""
        return Facets(name=self.name, corners=self.corners + np.array([x, y, z]), colour=self.colour)


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """How bodies are looked at: unit vectors to the right, up and to the eye (3, 3), pixels per mm, and the corner."""

    axes: Floats
    scale: float
    corner: Floats
    size: tuple[int, int]

    def pixels_of(self, places: Floats) -> Floats:
        """Return where places [mm], shape (..., 3), are seen: x and y in pixels from the upper left, and the depth."""
        seen = places @ self.axes.T
        x = (seen[..., 0] - self.corner[0]) * self.scale
        y = (self.corner[1] - seen[..., 1]) * self.scale
        return np.stack([x, y, seen[..., 2]], axis=-1)


def view_of(bodies: Sequence[Facets], eye: tuple[float, float, float], width: int, margin: float = 0.06) -> View:
    """Return the view from a direction that shows all bodies, `width` pixels wide with a margin [1] on each side."""
    back = np.array(eye) / np.linalg.norm(eye)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(back, right), back])
    seen = np.concatenate([body.corners.reshape(-1, 3) for body in bodies]) @ axes.T
    least, most = seen.min(axis=0)[:2], seen.max(axis=0)[:2]
    border = margin * float((most - least).max())
    span = most - least + 2.0 * border
    scale = width / float(span[0])
    corner = np.array([least[0] - border, most[1] + border])
    return View(axes=axes, scale=scale, corner=corner, size=(width, round(scale * float(span[1]))))


@dataclass(frozen=True, kw_only=True, eq=False)
class Rendering:
    """A picture, shape (height, width, 4), and which body is seen at each pixel, shape (height, width), -1 for none."""

    pixels: Pixels
    seen: Ints

    def anchor(self, body: int) -> tuple[float, float] | None:
        """Return the pixel (x, y) of a body nearest to the middle of what is seen of it; None where it is hidden."""
        y, x = np.nonzero(self.seen == body)
        if not len(x):
            return None
        nearest = int(np.hypot(x - np.median(x), y - np.median(y)).argmin())
        return float(x[nearest]), float(y[nearest])


def rendered(bodies: Sequence[Facets], view: View) -> Rendering:
    """Return the picture: shaded faces, dark edges, nothing where no body is."""
    corners = np.concatenate([body.corners for body in bodies])
    owner = np.repeat(np.arange(len(bodies)), [len(body.corners) for body in bodies])
    seen, normals = _turned_to(view, corners)
    owner = owner[seen]
    front, depth = frontmost(view.pixels_of(corners[seen]) * np.array([FINE, FINE, 1.0]), view.size)
    colours = np.array([body.colour for body in bodies])[owner] * _shade(normals)[:, None]
    shades = np.where(_edges(front, depth, normals, owner), len(colours), front)
    shown = np.append(owner, -1)[front][::FINE, ::FINE]
    return Rendering(pixels=reduced(shades, np.vstack([colours, _DARK])), seen=shown)


def _turned_to(view: View, corners: Floats) -> tuple[Ints, Floats]:
    """Return which triangles (triangles, 3, 3) [mm] are turned to the eye, and the unit normals of these."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    seen = np.flatnonzero((length > 0.0) & (normals @ view.axes[2] > 0.0))
    return seen, normals[seen] / length[seen, None]


def _shade(normals: Floats) -> Floats:
    """Return how bright faces are [1], shape (faces,), by their unit normals (faces, 3)."""
    towards_light = normals @ (_LIGHT / np.linalg.norm(_LIGHT))
    return np.asarray(_AMBIENT + (1.0 - _AMBIENT) * np.clip(towards_light, 0.0, 1.0))


def _edges(front: Ints, depth: Floats, normals: Floats, owner: Ints) -> NDArray[np.bool_]:
    """Return the pixels on an edge: where the next pixel shows another body, a face turned away, or what is behind."""
    found = np.zeros(front.shape, dtype=bool)
    whole, later, earlier = slice(None), slice(1, None), slice(None, -1)
    for here, there in (((whole, later), (whole, earlier)), ((later, whole), (earlier, whole))):
        edge = _apart(front[here], front[there], normals, owner)
        both = (front[here] >= 0) & (front[there] >= 0)
        edge[both] |= np.abs(depth[here][both] - depth[there][both]) > _STEP
        found[here] |= edge
        found[there] |= edge
    return found


def _apart(a: Ints, b: Ints, normals: Floats, owner: Ints) -> NDArray[np.bool_]:
    """Return where one triangle is none, or two are of other bodies or turned from each other; -1 for none."""
    apart = np.asarray((a >= 0) != (b >= 0))
    other = (a >= 0) & (b >= 0) & (a != b)
    a, b = a[other], b[other]
    turned = np.einsum("...i,...i", normals[a], normals[b]) < _FOLD
    apart[other] = turned | (owner[a] != owner[b])
    return apart
