"""One reading of a fruit: the modulus with its uncertainty, how the sensor stood, and what speaks against it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from instrument.press.measuring import MeasuringUnit
from pipeline.storage.plain import Plain
from sensor.arrays import Floats
from sensor.quantity import BOUNDED, COVERAGE, Estimate

AT_THE_EDGE = 1e-3  # of the range's ends: a fruit at one of them is inside it, whatever round-off does
IN_FIRMWARE = ("bad_force", "lift_off", "out_of_range", "saturated", "not_tared", "few_samples", "no_rise", "too_fast")
"""Flags of firmware, from bit 0 on. The command refuses what firmware flags as bad, saturated or not tared."""
UNCERTAIN = 0.5
"""Above this half width [1] a reading hardly tells the modulus, and no symmetric interval holds it."""
ZERO_AFTER_S = 1.0
"""Time after the lift of a press at which the zero that it leaves is told [s]."""


@dataclass(frozen=True, kw_only=True)
class FruitReading:
    """What forces tell of a fruit: E and E / (1 - nu^2) [MPa] with the half width `u` [1] that holds 95 %.

    All are None where the forces tell no modulus. `tilt` and `direction` [deg] are how the sensor stood on the skin,
    None where the layout does not tell. `others` are moduli [MPa] by other read-outs of the same forces. `t` [s] is the
    time of the reading in a signal. `relaxation` [1] is the apparent modulus late in the hold over that at its start,
    None where the flesh is not said to relax. `firmness` is what another instrument would show of this fruit [N or
    MPa], with its standard uncertainty, where the unit has that instrument's scale. `samples` is how many of a press
    were weighed. `noise` [1] is the part of `u` that falls with their number, None where it is not told apart. `bend`
    [1] is what `u` holds for lines of the calibration that are bent.

    `offset` [mm] is by how much the high tips stand nearer to the skin than the low ones, beyond what design and
    calibration say. `offset_u` [mm] is the half width that holds 95 %. A press of a line or a square tells them.

    `lines_left_out` are those of samples of the signal that contradict their press, at most some of them.

    `zero_left` [N] is the most that springs which creep show a second after the lift. It is of the tip where it is the
    largest fraction of the least force of a touch, and `zero_left_of_touch` is that fraction [1]. Both are None where
    springs show none.
    """

    E: float | None = None
    reduced: float | None = None
    u: float | None = None
    tilt: float | None = None
    direction: float | None = None
    flags: tuple[str, ...] = ()
    ripeness: str | None = None
    t: float | None = None
    samples: int | None = None
    noise: float | None = None
    bend: float = 0.0
    offset: float | None = None
    offset_u: float | None = None
    lines_left_out: tuple[int, ...] = ()
    others: dict[str, float] = field(default_factory=dict)
    relaxation: float | None = None
    firmness: Estimate | None = None
    zero_left: float | None = None
    zero_left_of_touch: float | None = None

    def with_flag(self, flag: str) -> "FruitReading":
        """Return this reading with one flag more."""
        return replace(self, flags=(*self.flags, flag))

    def of_samples(self, count: int, deviation: float) -> "FruitReading":
        """Return this reading as one of so many samples, whose noise leaves it a standard deviation [1]."""
        return replace(self, samples=count, noise=COVERAGE * deviation)

    def with_shift(self, shift: float) -> "FruitReading":
        """Return this reading, which moves by a fraction `shift` where one of its samples is left out.

        Where that is beyond the half width, the sample may be a bad one, and nothing tells. The half width of the
        reading then includes the reading without the sample.
        """
        if self.u is None or shift <= self.u:
            return self
        flags = [] if self.u > UNCERTAIN or self.u + shift <= UNCERTAIN else ["uncertain"]
        return replace(self, u=self.u + shift, flags=(*self.flags, *flags, "one_sample"))

    def with_offset(self, offset: float, u: float) -> "FruitReading":
        """Return this reading as one in which the high tips stand nearer to the skin by an offset +- u [mm]."""
        return replace(self, offset=offset, offset_u=u)

    def without_lines(self, lines: tuple[int, ...]) -> "FruitReading":
        """Return this reading as one that left lines of its signal out."""
        return replace(self, lines_left_out=lines)

    @property
    def left(self) -> float | None:
        """Return the part of the half width that no number of samples lowers [1], None where it is not told apart."""
        if self.u is None or self.noise is None:
            return None
        return math.sqrt(max(self.u**2 - self.noise**2, 0.0))


def reading_as_mapping(reading: FruitReading) -> Plain:
    """Return a reading as JSON data, keys with their unit."""
    of_press: Plain = {}
    if reading.t is not None:
        of_press = {
            "t_s": reading.t,
            "samples": reading.samples,
            "u_noise_percent": None if reading.noise is None else 100.0 * reading.noise,
            "u_left_percent": None if reading.left is None else 100.0 * reading.left,
        }
    if reading.bend:
        of_press = {**of_press, "u_bend_percent": 100.0 * reading.bend}
    offset: Plain = {}
    if reading.offset is not None:
        offset = {"offset_mm": reading.offset, "offset_u_mm": reading.offset_u}
    zero: Plain = {}
    if reading.zero_left is not None:
        zero = {"zero_left_N": reading.zero_left, "zero_left_of_touch": reading.zero_left_of_touch}
    firmness: Plain = {}
    if reading.firmness is not None:
        firmness[f"firmness_{reading.firmness.unit}"] = reading.firmness.value
        firmness["firmness_u_percent"] = COVERAGE * reading.firmness.percent
    return {
        **of_press,
        "E_MPa": reading.E,
        "E_over_1_minus_nu2_MPa": reading.reduced,
        "u_percent": None if reading.u is None else 100.0 * reading.u,
        "tilt_deg": reading.tilt,
        "tilt_direction_deg": reading.direction,
        **offset,
        "flags": list(reading.flags),
        **({"lines_left_out": list(reading.lines_left_out)} if reading.lines_left_out else {}),
        "class": reading.ripeness,
        **firmness,
        **{f"E_{name}_MPa": value for name, value in reading.others.items()},
        **({} if reading.relaxation is None else {"relaxation_ratio": reading.relaxation}),
        **zero,
    }


def flags_of_forces(sensor: MeasuringUnit, forces: Floats) -> tuple[str, ...]:
    """Return what is wrong with forces [N] by themselves: no numbers, below zero or far too large, or tips off."""
    flags = []
    if not sensor.in_scale(forces).all():
        flags.append("bad_force")
    if not (forces > sensor.least_forces).all():
        flags.append("lift_off")
    return tuple(flags)


def checked_reading(
    sensor: MeasuringUnit,
    E: float,
    u: float,
    forces: Floats,
    *,
    tilt: float | None = None,
    direction: float | None = None,
    lead: float | None = None,
) -> FruitReading:
    """Return a reading E [MPa] +- u [1] of forces [N] with its flags and class, tilt and direction [deg] if known.

    Those of a pair follow from the `lead` by which its high tip stands before the low one [mm].
    """
    if lead is not None:
        tilt = abs(math.degrees(math.atan(-lead / sensor.design.tips.spacing_mm)))
        direction = 0.0 if lead <= 0.0 else 180.0
    flags = []
    least, largest = sensor.range_MPa
    if not least * (1.0 - AT_THE_EDGE) <= E <= largest * (1.0 + AT_THE_EDGE):
        flags.append("out_of_range")
    if tilt is not None and tilt > sensor.steepest_deg:
        flags.append("tilt_beyond_design")
    if sensor.bruises(forces, E):
        flags.append("press_over_bruise_limit")
    if u > UNCERTAIN:
        flags.append("uncertain")
    scale = sensor.unit.scale
    firmness = None if scale is None else scale.firmness_of(E)
    if scale is not None and firmness is None:
        flags.append("beyond_scale")
    return FruitReading(
        E=E,
        reduced=sensor.reduced(E),
        u=u,
        tilt=tilt,
        direction=direction,
        flags=tuple(flags),
        ripeness=None if sensor.classes is None else sensor.classes.class_of(E),
        firmness=firmness,
    )


def half_width(sensor: MeasuringUnit, E: float, deviations: Sequence[float]) -> float:
    """Return the half width that holds 95 % of a reading of E [MPa], as a fraction of it [1].

    `deviations` are standard deviations [1] of what is read by noise and by the unit. E moves by the steepness of its
    level readings for each of them. Fruit, poses and the temperature of the leaves add to them. An error of the contact
    model may lie anywhere within its bound (JCGM 100:2008, 4.3.7).
    """
    of_read = math.hypot(*deviations, BOUNDED * sensor.model_error)
    return COVERAGE * math.hypot(sensor.steepness(E) * of_read, *sensor.by_heat, *sensor.by_fruit(E))
