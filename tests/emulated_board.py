"""An emulated ADS1220 on the pins of an emulated board, which runs the MicroPython program or the sketch for Arduino.

Numbers in comments are sections of its data sheet, Texas Instruments SBAS501C, August 2016. The chip shares no code
with the drivers: commands, registers and times stand here again.
"""

import contextlib
import ctypes
import io
import itertools
import re
import subprocess
import sys
import types
from pathlib import Path
from xml.etree import ElementTree

from deadline import DEADLINE_S

STUBS = Path(__file__).parent / "arduino"
SUPPLY_V = 3.3
INTERNAL_V = 2.048  # 8.3.6
CLOCK_MHZ = 4.096  # 8.3.7
CYCLES = (204850, 91218, 46226, 23762, 12562, 6994, 4242)  # 8.3.5: of a single shot in normal mode, by DR
RESET_US = 50.0 + 32.0 / CLOCK_MHZ  # 8.5.3.1
FASTEST_BAUD = 1e9 / 150.0  # 6.6
WRITE_US, READ_US = 1.0, 10.0  # that a board takes for a pin: little to set one, some more in a loop that waits
GREATEST = 2**23 - 1


class UnpluggedError(Exception):
    """The board has run for as long as it should."""


class Chip:
    """An ADS1220 whose inputs have levels, as shares of the supply, by input and time [us].

    `faults` are commands that no data sheet has, or that come when it takes none, and settings that measure no input
    against ground once. `conversions` are MUX, start [us] and count of those that were read.
    """

    def __init__(self, level):
        """Power up."""
        self.level = level
        self.answers = True
        self.converts = True
        self.faults = []
        self.conversions = []
        self.selected = False
        self.data_ready = 1
        self.data = 0
        self.of_data = (0, 0.0, 0)
        self.reset(-1000.0)  # the board has taken a millisecond to begin

    def reset(self, t):
        """Take the values after a reset, 8.6.1; no command is taken for a while."""
        self.registers = [0, 0, 0, 0]
        self.deaf_until = t + RESET_US
        self.started = None
        self.expected, self.shown = [], []

    def select(self, level):
        """Take the level of CS: high resets the serial interface, 8.5.1.1."""
        self.selected = not level
        self.expected, self.shown = [], []

    def ready_at(self):
        """Return when the conversion that runs is ready [us], 8.3.5."""
        if self.registers[1] >> 3 & 3 or not self.converts:  # a mode that is not the normal one
            return float("inf")
        return self.started + CYCLES[min(self.registers[1] >> 5, 6)] / CLOCK_MHZ

    def update(self, t):
        """Finish a conversion whose time has come: DRDY falls, 8.5.1.3."""
        if self.started is not None and t >= self.ready_at():
            end = self.ready_at()
            self.data = self.converted(0.5 * (self.started + end))
            self.of_data = (self.registers[0] >> 4, self.started, self.data)
            self.started = None
            self.data_ready = 0

    def converted(self, t):
        """Return the count of the inputs at a time, 8.5.2 and 8.6.1."""
        mux, gain = self.registers[0] >> 4, 2 ** (self.registers[0] >> 1 & 7)
        if self.registers[1] & 6 or not 8 <= mux < 12:
            self.faults.append(f"registers {self.registers}: temperature, continuous, or no single input")
            return 0
        reference = {0: INTERNAL_V, 3: SUPPLY_V}.get(self.registers[2] >> 6, 1e-9)
        count = round(self.level(mux - 8, t) * SUPPLY_V / reference * min(gain, 4) * 2**23)
        return max(-GREATEST - 1, min(count, GREATEST))

    def exchange(self, byte, t):
        """Take a byte, and return the one that is shifted out meanwhile."""
        if not (self.selected and self.answers):
            return 0xFF
        self.update(t)
        self.data_ready = 1  # at the first edge of SCLK, 8.5.1.3
        if t < self.deaf_until:
            self.faults.append(f"0x{byte:02X} {self.deaf_until - t:.0f} us too early")
            return 0
        if self.shown:  # no command is decoded while data are read, 8.5.5
            return self.shown.pop(0)
        if self.expected:
            self.registers[self.expected.pop(0)] = byte
            self.started = t  # every write starts a conversion, or starts it anew, 8.4.2.1
        elif byte >> 1 == 0b0000011:
            self.reset(t)
        elif byte >> 1 == 0b0000100:
            self.started = t
        elif byte >> 4 == 0b0001:
            self.shown = list((self.data % 2**24).to_bytes(3, "big"))
            self.conversions.append(self.of_data)
        elif byte >> 4 in (0b0010, 0b0100):
            first, count = byte >> 2 & 3, (byte & 3) + 1
            named = [index for index in range(first, first + count) if index < 4]
            self.expected = named if byte >> 4 == 0b0100 else []
            self.shown = [self.registers[index] for index in named] if byte >> 4 == 0b0010 else []
        else:
            self.faults.append(f"0x{byte:02X} is no command")
        return 0


class Board:
    """The pins, the bus and the clock of a board, a chip at those pins that `wires` name."""

    def __init__(self, chip, wires):
        """Begin at time 0."""
        self.chip = chip
        self.wires = wires
        self.t = 0.0
        self.until = float("inf")
        self.levels = {}
        self.printed = io.StringIO()

    def wait(self, us):
        """Let time pass [us]; raises UnpluggedError at the end."""
        self.t += us
        if self.t > self.until:
            raise UnpluggedError

    def write(self, pin, level):
        """Set the level of a pin."""
        self.t += WRITE_US
        self.levels[pin] = level
        if pin == self.wires["CS"]:
            self.chip.select(level)

    def read(self, pin):
        """Return the level of a pin; one that nothing drives is high."""
        self.t += READ_US
        self.chip.update(self.t)
        return self.chip.data_ready if pin == self.wires["DRDY"] and self.chip.answers else 1

    def transfer(self, byte, sck, mosi, miso, baud, msb_first, mode):
        """Return the byte that comes in while one goes out.

        The chip changes its line at rising edges and reads at falling ones, mode 1, 8.5.1, and takes the high bit
        first. It understands nothing else.
        """
        self.t += 8e6 / baud
        if (sck, mosi, msb_first, mode) != (self.wires["SCLK"], self.wires["DIN"], 1, 1) or baud > FASTEST_BAUD:
            return 0xFF
        back = self.chip.exchange(byte, self.t)
        return back if miso == self.wires["DOUT"] else 0xFF


def wires_of(path):
    """Return the numbers of the board's pins by the pins of the amplifier, and how its inputs are joined, of a plan.

    A wire starts on the right of the name of its pin, and ends on the left of the other one's.
    """
    drawn = list(ElementTree.parse(path).iter())
    words = [each for each in drawn if each.tag.endswith("text")]
    pins = {(float(each.get("x")), float(each.get("y"))): each.text for each in words}
    joined = []
    for each in drawn:
        if each.get("class") == "wire":
            x, y, _, end_y, end_x = map(float, re.findall(r"[\d.]+", each.get("d")))
            joined.append((pins[x - 1.5, y], pins[end_x + 1.5, end_y]))
    return joined


def board_pins(path):
    """Return the numbers of the board's pins by the pins of the amplifier, as a wiring plan joins them."""
    return {name: int(pin.removeprefix("GP")) for name, pin in wires_of(path) if pin.startswith("GP")}


def run_on_pico(program, board, seconds):
    """Run a MicroPython program for a time of its board, and return what it prints.

    Python runs it, with the modules `machine` and `time` of a board.
    """
    board.until = board.t + 1e6 * seconds

    class Pin:
        OUT, IN = 1, 0

        def __init__(self, number, mode=IN, value=None):
            self.number = number
            if mode == self.OUT:
                board.write(number, value)

        def value(self, *level):
            board.wait(1.0)
            return board.write(self.number, *level) if level else board.read(self.number)

    class Spi:
        def __init__(self, number, baudrate, polarity, phase, sck, mosi, miso):
            if (number, sck.number % 16, mosi.number % 16, miso.number % 16) not in _PICO_BUSES:
                raise ValueError("bad SCK, MOSI or MISO pin")
            self.pins = sck.number, mosi.number, miso.number
            self.baud, self.mode = baudrate, 2 * polarity + phase

        def write_readinto(self, written, taken):
            board.wait(5.0)
            taken[:] = bytes(board.transfer(byte, *self.pins, self.baud, 1, self.mode) for byte in written)

    clock = types.ModuleType("time")
    clock.ticks_us = lambda: board.wait(2.0) or int(board.t) % 2**30
    clock.ticks_diff = lambda end, start: (end - start + 2**29) % 2**30 - 2**29
    clock.sleep_us = board.wait
    machine = types.ModuleType("machine")
    machine.SPI, machine.Pin = Spi, Pin
    held = {name: sys.modules.get(name) for name in ("time", "machine")}
    sys.modules |= {"time": clock, "machine": machine}
    arguments, sys.argv = sys.argv, [""]
    try:
        with contextlib.redirect_stdout(board.printed), contextlib.suppress(UnpluggedError):
            exec(compile(program, "main.py", "exec"), {"__name__": "__main__"})
    finally:
        sys.argv = arguments
        for name, module in held.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module
    return board.printed.getvalue()


# RP2040 data sheet, functions of GPIO: the unit, and its pins for SCK, TX and RX, which come again after 16 pins.
_PICO_BUSES = [
    (unit, sck + 8 * unit, tx + 8 * unit, rx + 8 * unit)
    for unit, sck, tx, rx in itertools.product((0, 1), (2, 6), (3, 7), (0, 4))
]


def run_on_arduino(folder, board, seconds, flags=()):
    """Compile a sketch for this machine, run it for a time of its board, and return what it prints."""
    library = folder / "sketch.so"
    sources = ["-x", "c++", "sketch.ino", str(STUBS / "board.cpp")]
    words = ["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", "-O1", "-shared", "-fPIC", "-DARDUINO_ARCH_RP2040"]
    command = [*words, f"-I{STUBS}", *flags, "-include", "Arduino.h", *sources, "-o", str(library), "-lm"]
    subprocess.run(command, check=True, cwd=folder, timeout=DEADLINE_S, capture_output=True)
    sketch = ctypes.CDLL(str(library))

    def wait(us):
        board.t += us

    def show(text):
        board.printed.write(text.decode())

    functions = (board.write, board.read, lambda: board.t, wait, board.transfer, show)
    kinds = [kind for _, kind in _Doers._fields_]
    doers = _Doers(*(kind(function) for kind, function in zip(kinds, functions, strict=True)))
    sketch.plug(doers)
    sketch.set_up()
    until = board.t + 1e6 * seconds
    while board.t < until:
        sketch.loop_once()
    return board.printed.getvalue()


class _Doers(ctypes.Structure):
    """The functions that board.cpp takes."""

    _fields_ = (
        ("write", ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_int)),
        ("read", ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int)),
        ("now", ctypes.CFUNCTYPE(ctypes.c_double)),
        ("wait", ctypes.CFUNCTYPE(None, ctypes.c_double)),
        ("transfer", ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_int] * 4, ctypes.c_uint, ctypes.c_int, ctypes.c_int)),
        ("print", ctypes.CFUNCTYPE(None, ctypes.c_char_p)),
    )
