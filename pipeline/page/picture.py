"""A picture of the page: drawn by Matplotlib or from triangles, written as SVG that stands inside an HTML page.

Colours of plots are variables of the page's style sheet, so that one picture serves light and dark. Text is drawn as
paths of the font that Matplotlib brings along: the same on every machine.
"""

import base64
import io
import re
from contextlib import AbstractContextManager
from dataclasses import dataclass
from html import escape
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imsave
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]

INK, MUTED, LINE, PAPER = "#010201", "#010202", "#010203", "#010204"
SERIES = ("#010301", "#010302", "#010303", "#010304", "#010305", "#010306", "#010307")
GOOD, BAD = "#010401", "#010402"
_VARIABLES = {
    INK: "ink", MUTED: "muted", LINE: "line", PAPER: "paper", GOOD: "good", BAD: "bad",
    **{colour: f"c{number}" for number, colour in enumerate(SERIES, start=1)},
}  # fmt: skip
Place = Literal["lower right", "upper left", "center right"]
_NO_SOFTWARE: Any = {"Software": None}  # else the version of Matplotlib
_SIZE_IN = (5.4, 3.6)
_STYLE: Any = {  # Matplotlib's own type of it lists every key
    # pixels: of what is drawn with many triangles
    "savefig.dpi": 160.0,
    "svg.hashsalt": "twintip",
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "grid.color": LINE,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "legend.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
}


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


def plot_style() -> AbstractContextManager[None]:
    """Return the context in which axes get the style of the page."""
    return mpl.rc_context(_STYLE)


def plot_axes(x_label: str, y_label: str, size: tuple[float, float] = _SIZE_IN) -> Axes:
    """Return the axes of a new plot, of a size [inch], with grid and labels."""
    with plot_style():
        axes = Figure(figsize=size).add_axes((0.135, 0.155, 0.835, 0.81))
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        axes.grid(visible=True)
    return axes


def plot_picture(axes: Axes, name: str, title: str, caption: str, alt: str) -> Picture:
    """Return the picture of finished axes."""
    out = io.StringIO()
    nothing: Any = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with plot_style():
        axes.figure.savefig(out, format="svg", metadata=nothing)  # type: ignore[union-attr]
    svg = _inside_a_page(out.getvalue(), name, title, alt)
    return Picture(name=name, title=title, caption=caption, alt=alt, svg=svg)


def plot_legend(axes: Axes, place: Place | None) -> None:
    """Draw the legend of the axes at one of Matplotlib's places, or in a row above them."""
    with plot_style():
        if place is None:
            axes.legend(loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=3, columnspacing=1.0, borderpad=0.0)
        else:
            axes.legend(loc=place)


def _inside_a_page(text: str, name: str, title: str, alt: str) -> str:
    """Return SVG without what only a file of its own needs, its ids and colours made those of the page."""
    body = text[text.index("<svg") :]
    view = re.search(r'viewBox="([^"]+)"', body)
    inner = body[body.index(">") + 1 : body.rindex("</svg>")]
    inner = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", "", inner, flags=re.DOTALL)
    inner = inner.replace("xlink:href", "href")
    inner = re.sub(r'\bid="', f'id="{name}-', inner)
    inner = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", inner)
    for colour, variable in _VARIABLES.items():
        inner = inner.replace(colour, f"var(--{variable})")
    inner = re.sub(r"<path(?![^>]*\sd=)", '<path d="M0 0"', inner)  # of a blank
    inner = re.sub(r"\s*\n\s*", "\n", inner)
    return _svg(view[1] if view else "0 0 1 1", title, alt, inner)


def _svg(view: str, title: str, alt: str, inner: str) -> str:
    words = escape(f"{title}. {alt}")
    return f'<svg class="picture" viewBox="{view}" role="img" aria-label="{words}">{inner}</svg>'


def pixel_picture(pixels: Pixels, labels: tuple[Label, ...], name: str, title: str, words: tuple[str, str]) -> Picture:
    """Return the picture of pixels, shape (height, width, 4), with labels; `words` are its caption and its alt text."""
    height, width = pixels.shape[:2]
    out = io.BytesIO()
    imsave(out, pixels, format="png", metadata=_NO_SOFTWARE)
    data = base64.b64encode(out.getvalue()).decode()
    image = f'<image width="{width}" height="{height}" href="data:image/png;base64,{data}"/>'
    caption, alt = words
    svg = _svg(f"0 0 {width} {height}", title, alt, image + "".join(_drawn(label) for label in labels))
    return Picture(name=name, title=title, caption=caption, alt=alt, svg=svg)


def _drawn(label: Label) -> str:
    start = label.y - 26.0 if label.at_y < label.y else label.y + 8.0
    ends = f'x1="{label.x:.0f}" y1="{start:.0f}" x2="{label.at_x:.0f}" y2="{label.at_y:.0f}"'
    place = f'x="{label.x:.0f}" y="{label.y:.0f}" text-anchor="middle"'
    return f'<line class="leader" {ends}/><text class="label" {place}>{escape(label.text)}</text>'
