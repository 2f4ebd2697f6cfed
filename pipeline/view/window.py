"""A window with the pictures of an output folder side by side."""

import os
import sys
from typing import Any

import pyvista as pv

from pipeline.view.pictures import SIZE, Picture
from sensor.quantity import validation_error

Plotter = Any  # a PyVista plotter: its decorated methods have no types that strict mode takes

_COLUMNS = 3


def show_pictures(drawn: list[Picture], name: str) -> None:
    """Show pictures in one window until it is closed; raises InputError where no window can open."""
    if sys.platform == "linux" and not os.environ.get("DISPLAY") and not os.environ.get("WAYLAND_DISPLAY"):
        raise validation_error("display", None, "", "one that can open a window", "write pictures instead: --png DIR")
    window_of(drawn, name).show()


def window_of(drawn: list[Picture], name: str) -> Plotter:
    """Return the window with every picture drawn that it shows, not yet open."""
    placed = [picture for picture in drawn if picture.in_window]
    columns = min(_COLUMNS, len(placed))
    rows = -(-len(placed) // columns)
    plotter: Plotter = pv.Plotter(shape=(rows, columns), title=f"twintip: {name}", window_size=list(SIZE))
    for index, picture in enumerate(placed):
        plotter.subplot(index // columns, index % columns)
        plotter.set_background("white")
        picture.draw(plotter)
    return plotter
