"""The wiring plan of a read-out as a picture, wiring.svg."""

from collections.abc import Sequence
from pathlib import Path

from cad.fabrication.templates import render_template


def write_wiring(path: Path, names: Sequence[str], plates: int) -> None:
    """Write the wiring plan of a sensor's tips, in the order of its channels, as SVG; raises OSError."""
    on_plate = len(names) // plates
    channels = [f"{name}, plate {1 + i // on_plate}" if plates > 1 else name for i, name in enumerate(names)]
    picture = render_template("wiring.svg.jinja", channels=channels)
    path.write_text(picture, encoding="utf-8")
