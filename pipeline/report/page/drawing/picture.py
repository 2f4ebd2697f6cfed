"""A picture of the page: panels of a plot or pixels, as SVG that stands inside an HTML page."""

import base64
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from pipeline.report.page.drawing.panel import Box, Panel
from pipeline.report.page.drawing.scale import Scale

Pixels = NDArray[np.uint8]

SIZE = (389.0, 259.0)
"""Width and height of a plot [pt]."""
_PLOT = Box(left=52.0, top=9.0, width=325.0, height=210.0)  # with room for the scales of the one panel
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_RGBA = 6
_DEPTH = 8  # bits of each colour
_FROM_ABOVE = 2  # the filter of a row of pixels: its difference to the row above
_PACKED = 6  # how hard zlib tries, 1 to 9


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture of the page: its name, title and caption, what it shows in words for who cannot see it, its SVG."""

    name: str
    title: str
    caption: str
    alt: str
    svg: str


@dataclass(frozen=True, kw_only=True)
class Label:
    """A text beside a picture made of pixels, at a place in them, with a line to what it names at another place."""

    text: str
    x: float
    y: float
    at_x: float
    at_y: float


def plot_panel(name: str, x: Scale, x_label: str, y: Scale, y_label: str) -> Panel:
    """Return the one panel, still empty, of a plot of the usual size, whose name is given once in a page."""
    return Panel(name=name, box=_PLOT, x=x, y=y, x_label=x_label, y_label=y_label)


def plot_picture(
    panels: Sequence[Panel], name: str, title: str, words: tuple[str, str], size: tuple[float, float] = SIZE
) -> Picture:
    """Return the picture of panels on a sheet of a size [pt]; `words` are its caption and its alt text."""
    caption, alt = words
    inner = "\n".join(panel.svg() for panel in panels)
    svg = _svg(size, f"{title}. {alt}", inner)
    return Picture(name=name, title=title, caption=caption, alt=alt, svg=svg)


def pixel_picture(pixels: Pixels, labels: tuple[Label, ...], name: str, title: str, words: tuple[str, str]) -> Picture:
    """Return the picture of pixels, shape (height, width, 4), with labels; `words` are its caption and its alt text."""
    height, width = pixels.shape[:2]
    image = f'<image width="{width}" height="{height}" href="{png_address(pixels)}"/>'
    caption, alt = words
    inner = image + "".join(_drawn(label) for label in labels)
    svg = _svg((width, height), f"{title}. {alt}", inner)
    return Picture(name=name, title=title, caption=caption, alt=alt, svg=svg)


def _svg(size: tuple[float, float], words: str, inner: str) -> str:
    width, height = size
    view = f'viewBox="0 0 {width:g} {height:g}"'
    return f'<svg class="picture" {view} role="img" aria-label="{escape(words)}">{inner}</svg>'


def png_address(pixels: Pixels) -> str:
    """Return pixels, shape (height, width, 4), as the address of an image in PNG that holds all its data."""
    return f"data:image/png;base64,{base64.b64encode(_png(pixels)).decode()}"


def _png(pixels: Pixels) -> bytes:
    """Return pixels in PNG, ISO/IEC 15948: a header, the packed rows, an end."""
    height, width = pixels.shape[:2]
    rows = pixels.reshape(height, -1)
    above = np.concatenate([np.zeros_like(rows[:1]), rows[:-1]])
    filtered = np.concatenate([np.full((height, 1), _FROM_ABOVE, dtype=np.uint8), rows - above], axis=1)
    header = struct.pack(">IIBBBBB", width, height, _DEPTH, _RGBA, 0, 0, 0)
    packed = zlib.compress(filtered.tobytes(), _PACKED)
    return _SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"IDAT", packed) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def _drawn(label: Label) -> str:
    start = label.y - 26.0 if label.at_y < label.y else label.y + 8.0
    ends = f'x1="{label.x:.0f}" y1="{start:.0f}" x2="{label.at_x:.0f}" y2="{label.at_y:.0f}"'
    place = f'x="{label.x:.0f}" y="{label.y:.0f}" text-anchor="middle"'
    return f'<line class="leader" {ends}/><text class="label" {place}>{escape(label.text)}</text>'
