"""The wiring plan of a read-out, wiring.svg."""

from collections.abc import Sequence
from pathlib import Path

from cad.fabrication.sheet_templates import render_template
from sensor.design.readout import BOARDS

WIRES_OF_SENSOR = 3  # output, supply and ground of a Hall sensor
SUPPLY_WIRES = 2  # supply and ground, from the board to the amplifier


def count_wires(sensors: int, board: str) -> int:
    """Return the number of wires of the wiring plan of `sensors` Hall sensors; `board` is a key of `BOARDS`."""
    return WIRES_OF_SENSOR * sensors + len(BOARDS[board].pins) + SUPPLY_WIRES


def write_wiring(path: Path, names: Sequence[str], plates: int, board: str) -> None:
    """Write the wiring plan that connects the tips of a sensor to a board, as an SVG file.

    `names` are the names of the tips in the order of the channels, plate by plate. `plates` is the number of plates,
    and `board` is a key of `BOARDS`. Raises OSError if the file cannot be written.
    """
    tips_per_plate = len(names) // plates
    channels = list(names)
    if plates > 1:  # the number of the plate, counted from 1, is added to the name of each tip
        channels = [f"{name}, plate {1 + i // tips_per_plate}" for i, name in enumerate(names)]
    pins = BOARDS[board].pins  # maps the name of each amplifier pin to the GPIO number of the board's pin
    pin_names = [f"GP{number}" for number in pins.values()]  # the labels of the GPIO pins on the board
    picture = render_template(
        "wiring.svg.jinja",
        channels=channels,
        amplifier_pins=list(pins),
        board_pins=pin_names,
        board=BOARDS[board].label,
    )
    path.write_text(picture, encoding="utf-8")
