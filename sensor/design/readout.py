"""The electronics that convert the deflections of springs to counts: Hall sensors, amplifier, board.

Their data come from electronics.toml or from the design. If a design has a read-out, the noise of its forces and their
drift with temperature are computed.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from sensor.input_file import read_toml
from sensor.quantity import Bounds, Sourced, check_fields, choice, quantity, validation_error

_POSITIVE = Bounds(above=0.0, at_most=1e12)
_SIZE = Bounds(at_least=0.0, at_most=1e12)
_BITS = Bounds(at_least=8.0, at_most=32.0)
_DELAY = Bounds(at_least=0.0, at_most=1e4)
_KELVIN = Bounds(at_least=0.0, at_most=50.0)
_AS_SOLD = "omit it to use the data sheet of the amplifier"


@dataclass(frozen=True, kw_only=True)
class Amplifier(Sourced):
    """An amplifier with its converter. Its input range is +-`full_scale_mV`, with a resolution of `bits` bits.

    `noise_nV` is one standard deviation. `rate_Hz` is the sample rate of one channel. The `channels` inputs are
    converted one after the other. The error of the time of a conversion is at most `time_error_periods` of the time
    between two samples.
    """

    LABEL: ClassVar[str] = "amplifier"

    bits: float = quantity("1", _BITS)
    full_scale_mV: float = quantity("mV", _POSITIVE)
    supply_V: float = quantity("V", _POSITIVE)
    noise_nV: float = quantity("nV", _POSITIVE)
    rate_Hz: float = quantity("Hz", _POSITIVE)
    offset_nV_per_K: float = quantity("nV/K", _SIZE)
    gain_ppm_per_K: float = quantity("ppm/K", _SIZE)
    channels: float = quantity("1", _POSITIVE)
    time_error_periods: float = quantity("1", Bounds(at_least=0.0, at_most=1.0))

    @property
    def saturation(self) -> int:
        """Return the largest count [1], which is the end of the input range."""
        return int(2 ** (self.bits - 1.0)) - 1

    @property
    def counts_per_V(self) -> float:
        """Return the number of counts per volt at the input [1/V]."""
        return float(2.0 ** (self.bits - 1.0) / (1e-3 * self.full_scale_mV))


@dataclass(frozen=True, kw_only=True)
class Probe(Sourced):
    """A displacement sensor at a shuttle: its sensitivity, noise (one standard deviation), drifts and dimensions.

    The sensitivity holds at the supply voltage. `zero_um` is the zero error at constant temperature. `magnet_mm` is
    the diameter of each of the two magnetic discs. `face_out_mm` is the distance from their faces to the marked face
    of the sensor. The package is `package_height_mm` long in the direction of the press.
    """

    LABEL: ClassVar[str] = "probe"

    sensitivity_mV_per_mm: float = quantity("mV/mm", _POSITIVE)
    noise_um: float = quantity("um", _SIZE)
    zero_um_per_K: float = quantity("um/K", _SIZE)
    zero_um: float = quantity("um", _SIZE)
    gain_percent_per_K: float = quantity("%/K", _SIZE)
    linearity_percent: float = quantity("%", _SIZE)
    magnet_mm: float = quantity("mm", _POSITIVE)
    magnet_height_mm: float = quantity("mm", _POSITIVE)
    magnets_apart_mm: float = quantity("mm", _POSITIVE)
    face_out_mm: float = quantity("mm", _POSITIVE)
    package_width_mm: float = quantity("mm", _POSITIVE)
    package_height_mm: float = quantity("mm", _POSITIVE)
    package_thickness_mm: float = quantity("mm", _POSITIVE)


@dataclass(frozen=True, kw_only=True)
class Board(Sourced):
    """A microcontroller board: the number of its SPI unit, and the number of its pin for each pin of the amplifier."""

    LABEL: ClassVar[str] = "board"

    label: str
    spi: float = quantity("1", _SIZE)
    sclk: float = quantity("1", _SIZE)
    din: float = quantity("1", _SIZE)
    dout: float = quantity("1", _SIZE)
    cs: float = quantity("1", _SIZE)
    drdy: float = quantity("1", _SIZE)

    @property
    def pins(self) -> dict[str, int]:
        """Return a mapping from the name of each amplifier pin to the number of the board pin connected to it."""
        return {name: int(getattr(self, name.lower())) for name in ("SCLK", "DIN", "DOUT", "CS", "DRDY")}


_TABLES = read_toml(Path(__file__).with_name("electronics.toml"), "electronics")
AMPLIFIERS = Amplifier.from_tables(_TABLES["amplifier"])
USUAL_AMPLIFIER = "ADS1220"
BOARDS = Board.from_tables(_TABLES["board"])
PROBE = Probe.from_tables(_TABLES["probe"])["DRV5055A2"]


@dataclass(frozen=True, kw_only=True)
class Readout:
    """The signal path of a design. A number that is not set comes from the amplifier or the displacement sensor.

    A sample holds one conversion per channel. The conversion of a channel begins `delay_ms` after the first conversion
    of the sample. `drift_K` is the largest change in temperature between the calibration and a press, and `tare_K` the
    largest change between the last taring and a press.
    """

    amplifier: str | None = choice(
        tuple(AMPLIFIERS), default=None, meaning=f"amplifier with its converter; by default {USUAL_AMPLIFIER}"
    )
    board: str = choice(
        tuple(BOARDS),
        default="rp2040",
        meaning="microcontroller board of the wiring plan and of the MicroPython program",
    )
    bits: float | None = quantity(
        "1", _BITS, default=None, hint=_AS_SOLD, meaning="bits of the converter, including the sign bit"
    )
    full_scale_mV: float | None = quantity(
        "mV", _POSITIVE, default=None, hint=_AS_SOLD, meaning="input range of the amplifier on either side of zero"
    )
    rate_Hz: float | None = quantity("Hz", _POSITIVE, default=None, hint=_AS_SOLD, meaning="sample rate of one channel")
    noise_nV: float | None = quantity(
        "nV",
        _POSITIVE,
        default=None,
        hint=_AS_SOLD,
        meaning="noise at the input of the amplifier at this sample rate, one standard deviation",
    )
    delay_ms: tuple[float, ...] | None = quantity(
        "ms",
        _DELAY,
        default=None,
        hint="omit it to convert in the order of the amplifier's inputs",
        meaning="delay of the conversion of each channel after the first conversion of the sample, in the order of the "
        "tips",
    )
    time_error_ms: float | None = quantity(
        "ms",
        _DELAY,
        default=None,
        hint=_AS_SOLD,
        meaning="largest error of a conversion time, in addition to `delay_ms`",
    )
    sensitivity_mV_per_mm: float | None = quantity(
        "mV/mm",
        _POSITIVE,
        default=None,
        hint="omit it for a DRV5055A2 between two magnets",
        meaning="sensitivity of a displacement sensor; by default the sensitivity of a DRV5055A2 between two magnets",
    )
    noise_um: float | None = quantity(
        "um",
        _SIZE,
        default=None,
        hint="omit it for a DRV5055A2 between two magnets",
        meaning="noise of a displacement sensor, one standard deviation",
    )
    drift_K: float = quantity(
        "K",
        _KELVIN,
        default=5.0,
        hint="the temperature of a room varies by up to 5",
        meaning="largest difference between the air temperatures at a press and at the calibration",
    )
    tare_K: float = quantity(
        "K",
        _KELVIN,
        default=1.0,
        hint="tare before each fruit to keep it small",
        meaning="largest difference between the air temperatures at a press and at the last taring",
    )

    def __post_init__(self) -> None:
        """Check each field. A delay must be shorter than the time between two samples."""
        check_fields(self, "readout")
        period_ms = 1e3 / self.circuit.rate_Hz
        if self.delay_ms is not None and max(self.delay_ms) > period_ms:
            bound = f"at most the {period_ms:g} ms between two samples"
            hint = "shorten the delay, or lower rate_Hz"
            raise validation_error("readout.delay_ms", max(self.delay_ms), "ms", bound, hint)

    @property
    def largest_time_error_ms(self) -> float:
        """Return the largest error of a conversion time [ms], in addition to its delay."""
        amplifier = self.circuit
        typical = 1e3 / amplifier.rate_Hz * amplifier.time_error_periods
        return typical if self.time_error_ms is None else self.time_error_ms

    @property
    def circuit(self) -> Amplifier:
        """Return the amplifier, with the numbers that the design overrides."""
        numbers = {}
        for name in ("bits", "full_scale_mV", "rate_Hz", "noise_nV"):
            value = getattr(self, name)
            if value is not None:
                numbers[name] = value
        return replace(AMPLIFIERS[self.amplifier or USUAL_AMPLIFIER], **numbers)
