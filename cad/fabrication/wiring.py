"""The wiring plan of a read-out as a picture: transducers by tip and plate, amplifiers, board, and every wire by pin.

The pins of the board are those of the MicroPython program that `pipeline read --micropython` writes.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.drawing.canvas import Box, Canvas

_PITCH = 8.0  # of pins [mm of paper]
_TEXT = 2.5
_STUB = 6.0
_MARGIN = 8.0
_CHANNEL = 4.0  # between wires that run side by side
_TITLE = 12.0  # over the pins of a part
_COLUMNS = (20.0, 120.0, 220.0)  # left edges: transducers, amplifiers, board
_WIDTH = 52.0


@dataclass(frozen=True, kw_only=True)
class _Part:
    """A box with its name, its pins by side from the top, and the level of its upper edge [mm]."""

    name: str
    left: float
    top: float
    left_pins: tuple[str, ...] = ()
    right_pins: tuple[str, ...] = ()

    @property
    def box(self) -> Box:
        """Return its outline [mm]."""
        pins = max(len(self.left_pins), len(self.right_pins))
        return Box(self.left, self.top - _TITLE - _PITCH * pins, self.left + _WIDTH, self.top)

    def pin(self, name: str, *, right: bool) -> tuple[float, float]:
        """Return where a pin is [mm]."""
        pins = self.right_pins if right else self.left_pins
        level = self.top - _TITLE - _PITCH * pins.index(name)
        return (self.box.right if right else self.left), level


def write_wiring(path: Path, transducer: str, names: Sequence[str], plates: int, resistor_ohm: float) -> None:
    """Write the wiring plan of a sensor's tips, in the order of its channels, as SVG; raises OSError."""
    canvas = Canvas(1.0)
    on_plate = len(names) // plates
    titles = [f"{name}, plate {1 + i // on_plate}" if plates > 1 else name for i, name in enumerate(names)]
    if transducer == "foil":
        _foil(canvas, titles, resistor_ohm)
    else:
        _probes(canvas, titles)
    drawn = canvas.extents()
    window = Box(drawn.left - _MARGIN, drawn.bottom - _MARGIN, drawn.right + _MARGIN, drawn.top + _MARGIN)
    canvas.write_svg(path, window)


def _foil(canvas: Canvas, titles: Sequence[str], resistor_ohm: float) -> None:
    """Draw a full bridge and an HX711 for each tip, one clock for all, and the board."""
    terminals = ("E+", "A+", "A-", "E-")
    height = _TITLE + 5.0 * _PITCH
    data = tuple(f"GP{3 + i}" for i in range(len(titles)))
    board = _Part(name="RP2040 board", left=_COLUMNS[2], top=0.0, left_pins=("GP2", *data, "3V3", "GND"))
    _draw(canvas, board, {"3V3": "3V3", "GND": "GND"})
    for i, title in enumerate(titles):
        top = -i * height
        bridge = _Part(name=f"bridge {title}", left=_COLUMNS[0], top=top, right_pins=terminals)
        amplifier = _Part(
            name=f"HX711 no. {i + 1}",
            left=_COLUMNS[1],
            top=top,
            left_pins=terminals,
            right_pins=("SCK", "DT", "VCC 5 V, VDD 3V3", "GND"),
        )
        _draw(canvas, bridge)
        _draw(canvas, amplifier, {"VCC 5 V, VDD 3V3": "", "GND": "GND"})
        _bridge_inside(canvas, bridge)
        for terminal, colour in zip(terminals, ("red", "white", "green", "black"), strict=True):
            start = bridge.pin(terminal, right=True)
            end = amplifier.pin(terminal, right=False)
            canvas.line(start, end)
            canvas.words(colour, (start[0] + 7.0, start[1] + 2.0), _TEXT)
            if terminal.startswith("E") and resistor_ohm:
                _resistor(canvas, 0.5 * (start[0] + end[0]) + 5.0, start[1], f"{resistor_ohm:g} ohm")
        _wire(canvas, amplifier.pin("SCK", right=True), board.pin("GP2", right=False), 4.0 * _CHANNEL)
        _wire(canvas, amplifier.pin("DT", right=True), board.pin(data[i], right=False), (i + 5) * _CHANNEL)


def _probes(canvas: Canvas, titles: Sequence[str]) -> None:
    """Draw a Hall sensor for each tip, an ADS1220 for four of them, and the board."""
    inputs = tuple(f"AIN{i}" for i in range(len(titles)))
    digital = ("SCLK", "DIN", "DOUT", "CS", "DRDY")
    supply = {"AVDD, DVDD": "3V3", "AVSS, DGND, CLK": "GND", "VCC": "3V3", "GND": "GND", "3V3": "3V3"}
    amplifier = _Part(
        name="ADS1220",
        left=_COLUMNS[1],
        top=0.0,
        left_pins=(*inputs, "AVDD, DVDD", "AVSS, DGND, CLK"),
        right_pins=digital,
    )
    pins = tuple(f"GP{2 + i}" for i in range(len(digital)))
    board = _Part(name="RP2040 board", left=_COLUMNS[2], top=0.0, left_pins=(*pins, "3V3", "GND"))
    _draw(canvas, amplifier, supply)
    _draw(canvas, board, supply)
    for i, title in enumerate(titles):
        height = _TITLE + 3.5 * _PITCH
        probe = _Part(name=f"DRV5055A2 {title}", left=_COLUMNS[0], top=-i * height, right_pins=("OUT", "VCC", "GND"))
        _draw(canvas, probe, supply)
        channel = (len(titles) - i) * _CHANNEL + 14.0  # the lower the sensor, the nearer to it its wire turns up
        _wire(canvas, probe.pin("OUT", right=True), amplifier.pin(inputs[i], right=False), channel)
    for i, name in enumerate(digital):
        _wire(canvas, amplifier.pin(name, right=True), board.pin(pins[i], right=False), 10.0)


def _draw(canvas: Canvas, part: _Part, supply: dict[str, str] | None = None) -> None:
    """Draw a part with its pins; a pin of the supply has a stub with the name of what it is joined to."""
    canvas.rectangle(part.box)
    canvas.words(part.name, (0.5 * (part.box.left + part.box.right), part.top - 4.0), 0.9 * _TEXT)
    for right, pins in ((False, part.left_pins), (True, part.right_pins)):
        outward = 1.0 if right else -1.0
        for name in pins:
            x, level = part.pin(name, right=right)
            half = 0.4 * _TEXT * len(name)
            canvas.words(name, (x - outward * (half + 1.5), level), _TEXT)
            joined = (supply or {}).get(name, "")
            if joined:
                canvas.line((x, level), (x + outward * _STUB, level))
                canvas.words(joined, (x + outward * (_STUB + 4.0), level), _TEXT)


def _wire(canvas: Canvas, start: tuple[float, float], end: tuple[float, float], channel: float) -> None:
    """Draw a wire that changes its level at a distance from its start [mm]."""
    turn = start[0] + channel
    canvas.line(start, (turn, start[1]))
    if not math.isclose(start[1], end[1]):
        canvas.line((turn, start[1]), (turn, end[1]))
    canvas.line((turn, end[1]), end)


def _resistor(canvas: Canvas, middle: float, level: float, value: str) -> None:
    canvas.rectangle(Box(middle - 4.0, level - 1.2, middle + 4.0, level + 1.2))
    canvas.words(value, (middle, level + 3.0), 0.8 * _TEXT)


def _bridge_inside(canvas: Canvas, part: _Part) -> None:
    """Draw the four gauges of a bridge as a diamond: E+ above, E- below, A- on the left, A+ on the right."""
    middle = part.left + 22.0
    level = part.top - _TITLE - 1.5 * _PITCH
    half = 9.0
    above = (middle, level + half)
    below = (middle, level - half)
    left = (middle - half, level)
    right = (middle + half, level)
    arms = [(above, left, "W down"), (above, right, "S down"), (below, left, "W up"), (below, right, "S up")]
    for start, end, gauge in arms:
        canvas.line(start, end)
        outward = math.copysign(8.0, end[0] - middle)
        canvas.words(gauge, (0.5 * (start[0] + end[0]) + outward, 0.5 * (start[1] + end[1])), 0.7 * _TEXT)
