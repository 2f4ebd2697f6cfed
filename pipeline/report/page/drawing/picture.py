"""A picture of the page: panels of a plot as SVG that stands inside an HTML page."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import NamedTuple

from pipeline.report.page.drawing.panel import Box, Panel
from pipeline.report.page.drawing.scale import Scale


class Size(NamedTuple):
    """Width and height of a picture [pt]."""

    width: float
    height: float


SIZE = Size(389.0, 259.0)
_PLOT = Box(left=52.0, top=9.0, width=325.0, height=210.0)  # with room for the scales of the one panel


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture of the page: its name, title and caption, its SVG."""

    name: str
    title: str
    caption: str
    svg: str


def plot_panel(name: str, x: Scale, x_label: str, y: Scale, y_label: str) -> Panel:
    """Return the one panel, still empty, of a plot of the usual size, whose name is given once in a page."""
    return Panel(name=name, box=_PLOT, x=x, y=y, x_label=x_label, y_label=y_label)


def plot_picture(panels: Sequence[Panel], name: str, title: str, caption: str, size: Size = SIZE) -> Picture:
    """Return the picture of panels on a sheet."""
    inner = "\n".join(panel.svg() for panel in panels)
    view = f'viewBox="0 0 {size.width:g} {size.height:g}"'
    words = escape(f"{title}. {caption}")
    svg = f'<svg class="picture" {view} role="img" aria-label="{words}">{inner}</svg>'
    return Picture(name=name, title=title, caption=caption, svg=svg)
