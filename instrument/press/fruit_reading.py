"""The reading of one press on a fruit: the modulus with its uncertainty, the tilt of the sensor, and flags."""

import math
from dataclasses import dataclass

from instrument.press.half_width import HalfWidth
from instrument.press.measuring import MeasuringUnit
from pipeline.storage.plain import Plain
from sensor.arrays import Floats
from sensor.attributes import with_attributes
from sensor.quantity import COVERAGE, Estimate, report_field
from sensor.words import value_with_bar

# Relative tolerance at the ends of the range, so that round-off does not exclude a fruit at an end.
RANGE_TOLERANCE = 1e-3
UNCERTAIN = 0.5
"""Relative half width [1] above which a reading is flagged, because a symmetric interval no longer describes it."""
ZERO_AFTER_S = 1.0
"""Time after the lift of a press for which its zero error is reported [s]."""

SHOWN_ZERO_ERROR = 0.5
"""Smallest zero error that is shown on the screen, as a fraction of the smallest contact force [1]."""


def _tilt_text(reading: "FruitReading") -> str:
    """Return the tilt of the sensor on the skin as text, with its direction if it is known."""
    towards = "" if reading.direction is None else f" towards {reading.direction:.0f} deg"
    return f"tilt {reading.tilt:.2g} deg{towards}"


def _zero_text(reading: "FruitReading") -> str:
    """Return the zero error after a press as text; the text is empty if the error is too small to look like a touch."""
    # Both fields are None if the springs do not creep. The zero error is then 0.
    if (reading.zero_left_of_touch or 0.0) <= SHOWN_ZERO_ERROR:
        return ""
    zero = f"{reading.zero_left:.2g} N, {reading.zero_left_of_touch:.2g} of a touch,"
    return f"leaves a zero error of up to {zero} {ZERO_AFTER_S:g} s after its lift"


def firmness_text(firmness: Estimate) -> str:
    """Return the firmness on the scale of another instrument as text, with the half width that holds 95 % of fruit."""
    value = value_with_bar(firmness.value, COVERAGE * firmness.error, firmness.unit, in_percent=True)
    return f"firmness {value} (95 %)"


def _flags_text(reading: "FruitReading") -> str:
    """Return the flags as text, with an explanation of the flag `uncertain`."""
    text = f"flags: {', '.join(reading.flags)}"
    if "uncertain" in reading.flags:
        return f"{text}; E is hardly known: no symmetric interval holds it"
    return text


def _noise_data(reading: "FruitReading") -> Plain:
    """Return the part of the half width due to noise, and the remaining part, in percent, under their keys in JSON."""
    parts = {"u_noise_percent": reading.noise, "u_left_percent": reading.left}
    return {key: None if part is None else 100.0 * part for key, part in parts.items()}


def firmness_data(firmness: Estimate) -> Plain:
    """Return the firmness on the scale of another instrument, under a key that contains its unit."""
    return {f"firmness_{firmness.unit}": firmness.value, "firmness_u_percent": COVERAGE * firmness.percent}


@with_attributes
@dataclass(frozen=True, kw_only=True)
class FruitReading:
    """The reading of one press on a fruit: the modulus with its uncertainty, the tilt, and flags.

    `pipeline read` prints the same numbers. `docs/read-a-fruit.md` explains each flag. A number that is missing in the
    JSON output is None here, and a missing list or text is empty.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # written by pipeline run
    >>> [reading] = twintip.read_press(report, "press.csv")
    >>> reading.E * reading.u > 0.0  # half width of E [MPa]
    True
    """

    t: float | None = report_field(
        "s",
        "time of the deepest sample of a press",
        key="t_s",
        left_out=True,
        default=None,
        line=lambda it: f"t {it.t:.3f} s",
    )
    samples: int | None = report_field(
        "1", "number of samples of the press that count in E", left_out="t", default=None
    )
    noise: float | None = report_field(
        "%",
        "the part of `u_percent` due to noise, which falls with the samples; its square and that of the rest add",
        key="`u_noise_percent`, `u_left_percent`",
        inline=_noise_data,
        attribute_unit="1",
        left_out="t",
        default=None,
        line=lambda it: f"of which noise {100.0 * it.noise:.2g} % over {it.samples} samples",
    )
    bend: float = report_field(
        "%",
        "the part of `u_percent` that is added for [lines that bend](#lines-that-bend); left out if none bends",
        key="u_bend_percent",
        times=100.0,
        attribute_unit="1",
        left_out=True,
        default=0.0,
        line=lambda it: f"of which {100.0 * it.bend:.2g} % by bent channels and springs",
    )
    E: float | None = report_field(
        "MPa",
        "the modulus at the Poisson's ratio of the design; between 0.3 and 0.45 it moves E by 14 %",
        key="E_MPa",
        default=None,
        line=lambda it: f"E {value_with_bar(it.E, it.u * it.E, 'MPa', in_percent=True)} (95 %)",
        absent="no modulus",
    )
    reduced: float | None = report_field(
        "MPa",
        "the modulus that the forces depend on, whatever Poisson's ratio is",
        key="E_over_1_minus_nu2_MPa",
        default=None,
        line=lambda it: f"E/(1 - nu^2) {it.reduced:.4g} MPa",
    )
    u: float | None = report_field(
        "%",
        "half width that holds the true E in 95 of 100 readings; the same percentage holds for E/(1 - nu^2)",
        key="u_percent",
        times=100.0,
        attribute_unit="1",
        default=None,
    )
    tilt: float | None = report_field(
        "deg",
        "tilt of the sensor on the skin; for a line and a pair only along the tips",
        key="tilt_deg",
        default=None,
        line=_tilt_text,
    )
    direction: float | None = report_field(
        "deg", "direction of the lower side of the sensor, from +x towards +y", key="tilt_direction_deg", default=None
    )
    offset: float | None = report_field(
        "mm",
        "only for a square or a line: how much nearer to the skin the high tips stand than the low ones, "
        "beyond the design. A saddle of the skin or wrong heights of the tips cause it",
        key="offset_mm",
        left_out=True,
        default=None,
        line=lambda it: f"high tips nearer to the skin by {value_with_bar(it.offset, it.offset_u, 'mm')}",
    )
    offset_u: float | None = report_field(
        "mm", "half width of `offset_mm` at 95 %", key="offset_u_mm", left_out=True, default=None
    )
    flags: tuple[str, ...] = report_field(
        "", "flags of the reading, each a reason to doubt it", default=(), line=_flags_text
    )
    lines_left_out: tuple[int, ...] = report_field(
        "",
        "lines of the file whose samples contradict their press and do not count",
        left_out=True,
        default=(),
        line=lambda it: f"left out line {', '.join(map(str, it.lines_left_out))}",
    )
    ripeness: str | None = report_field(
        "",
        "ripeness, by `--classes` or by the unit; limits are moduli [MPa]",
        key="class",
        default=None,
        line=lambda it: f"class {it.ripeness}",
    )
    firmness: Estimate | None = report_field(
        "N or MPa, %",
        "the number of the other instrument, by the scale of the unit, and the half width that holds 95 % of fruit",
        key="`firmness_N` or `firmness_MPa`, `firmness_u_percent`",
        inline=lambda it: firmness_data(it.firmness),
        left_out=True,
        default=None,
        line=lambda it: firmness_text(it.firmness),
    )
    others: dict[str, float] = report_field(
        "MPa",
        "[another way to read a pair](#which-modulus-of-a-pair), or the modulus at the moment of the reading of "
        "[flesh that relaxes](#flesh-that-relaxes)",
        key="`E_force_ratio_MPa`, `E_apparent_MPa`",
        inline=lambda it: {f"E_{name}_MPa": E for name, E in it.others.items()},
        default_factory=dict,
        line=lambda it: "  ".join(f"by {name.replace('_', ' ')} {E:.4g} MPa" for name, E in it.others.items()),
    )
    relaxation: float | None = report_field(
        "1",
        "for [flesh that relaxes](#flesh-that-relaxes): the apparent modulus late in the hold over its value at the "
        "start",
        key="relaxation_ratio",
        left_out=True,
        default=None,
        line=lambda it: f"relaxes to {it.relaxation:.3g}",
    )
    zero_left: float | None = report_field(
        "N",
        "for springs that creep: the largest force that a tip shows a second after the lift",
        key="zero_left_N",
        left_out=True,
        default=None,
        line=_zero_text,
    )
    zero_left_of_touch: float | None = report_field(
        "1", "`zero_left_N` divided by the least force of a touch", left_out=True, default=None
    )
    fruit: str = report_field("", "the fruit of the press, where the file names it", has_key=False, default="")
    press_s: float | None = report_field(
        "s", "duration of the press, None if it is unknown", has_key=False, default=None
    )
    time_s: float = report_field("s", "standard deviation of the time of each channel", has_key=False, default=0.0)
    parts: HalfWidth | None = report_field(
        "1", "the parts of `u`, by whether the presses of a fruit share them", has_key=False, default=None
    )

    @property
    def left(self) -> float | None:
        """Return the part of the half width that more samples do not reduce [1]; None if the noise is unknown."""
        if self.u is None or self.noise is None:
            return None
        return math.sqrt(max(self.u**2 - self.noise**2, 0.0))


LINE = (
    *("t", "reduced", "E", "noise", "bend", "tilt", "offset", "others", "relaxation", "zero_left", "firmness"),
    *("ripeness", "lines_left_out", "flags"),
)
"""The fields of a reading in their order on the screen: the modulus first, the flags last."""


def flags_of_forces(sensor: MeasuringUnit, forces: Floats) -> tuple[str, ...]:
    """Return the flags of one sample with the `forces` (tips,) [N].

    The flag `bad_force` means that a force is implausible, and `lift_off` that a tip is out of contact.
    """
    flags = []
    if not sensor.are_plausible(forces).all():
        flags.append("bad_force")
    if not (forces > sensor.least_forces).all():
        flags.append("lift_off")
    return tuple(flags)


def flags_of_modulus(sensor: MeasuringUnit, E: float, u: float, forces: Floats, tilt: float | None = None) -> list[str]:
    """Return the flags of a reading E [MPa] with the relative half width u [1], in their order on the screen.

    `forces` (tips,) [N] are the forces of the deepest sample. The `tilt` [deg] is checked only if it is known.
    """
    modulus_causes = causes_of_modulus(sensor, E, u)
    causes = {
        "out_of_range": modulus_causes["out_of_range"],  # shown first; the other causes of the modulus are shown last
        # The half width of a measured tilt is added to the limit of the design.
        "tilt_beyond_design": tilt is not None and tilt > sensor.steepest_deg + COVERAGE * sensor.tilt_deviation_deg,
        "press_over_bruise_limit": sensor.bruises(forces, E),
        **modulus_causes,
    }
    return [flag for flag, applies in causes.items() if applies]


def causes_of_modulus(sensor: MeasuringUnit, E: float, u: float) -> dict[str, bool]:
    """Return each flag that depends only on E [MPa] and its relative half width u [1], and whether it applies.

    A unit with a firmness scale has the flag `beyond_scale` if the scale does not cover E.
    """
    least, largest = sensor.range_MPa
    scale = sensor.unit.scale
    return {
        "out_of_range": not least * (1.0 - RANGE_TOLERANCE) <= E <= largest * (1.0 + RANGE_TOLERANCE),
        "uncertain": u > UNCERTAIN,
        "beyond_scale": scale is not None and scale.firmness_of(E) is None,
    }
