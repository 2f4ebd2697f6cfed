"""A printed unit: its springs, tips and channels as calibrated, stored in unit.toml."""

import hashlib
import itertools
import json
import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

from instrument.press.fruit_scale import FruitScale
from instrument.press.reference_ball import BallCorrection
from pipeline.report.report import Report
from pipeline.storage.plain import from_plain, to_plain
from sensor.design.design_file import design_as_mapping, tables_as_toml
from sensor.design.parameters import Design
from sensor.design.reading import WEIGHED_AFTER_S, ReadingRequirements
from sensor.design.tips import REPRESENTED_BY_BALL
from sensor.input_file import read_toml
from sensor.quantity import (
    UNIFORM_DEVIATION,
    Bounds,
    InputError,
    check_fields,
    check_number,
    choice,
    quantity,
    validation_error,
)
from sensor.theory.creep import CreepLaw

_HINT = "take the numbers that pipeline calibrate wrote"
_STIFFNESS = Bounds(above=0.0, at_most=1e9)
_GAIN = Bounds(at_least=0.1, at_most=10.0)
_SPRING_ERROR = Bounds(above=0.0, at_most=100.0)  # not 0, because no stiffness is known exactly
_ERROR = Bounds(at_least=0.0, at_most=100.0)
WEIGHED_AFTER = Bounds(above=0.0, at_most=365.25 * 86400.0)
"""Allowed time between hanging a weight and reading it [s]: at most a year."""
_BEND = Bounds(at_least=-1e6, at_most=1e6)
_CREEP = Bounds(at_least=0.0, below=1.0)
# Keys of unit.toml that are given together or not at all.
_KEY_PAIRS = (
    ("creep_per_decade", "creep_error"),
    ("force_bend", "force_bend_per_N"),
    ("deflection_bend", "deflection_bend_per_N"),
)
_LARGEST_COUNT = 2**31 - 1  # firmware stores counts as 32-bit integers
_FORMER_KEYS = ("height_mm", "height_error_mm")
"""Keys that version 0.1 wrote. They are ignored, because the heights of the tips cancel in a press."""
_SAFE_TEXT = re.compile(r"[\w ,.:()-]*", re.ASCII)  # characters that are safe in a comment of the firmware


@dataclass(frozen=True, kw_only=True)
class PrintedUnit:
    """A calibrated unit: its springs, tips and channels in the order of its tips, as in unit.toml.

    Attributes
    ----------
    design, design_sha256 : str
        Name and digest of the design that was printed.
    tips : tuple of str
        Names of the tips.
    method : str
        How the numbers were found.
    K_N_per_m : tuple of float
        Stiffness of each spring [N/m].
    K_percent : tuple of float
        Standard deviation of each stiffness [%].
    gain : tuple of float
        Factor from the reading of each channel [N] to its force [N].
    gain_percent : tuple of float
        Standard deviation of each gain [%]; for calibration on a plate, the standard deviation of the deflection [%].
    newtons_per_count : tuple of tuple of float
        Matrix (tips, channels) from counts above tare to the forces of the tips [N]; empty if counts are uncalibrated.
    zero_counts : tuple of float
        Tare of each channel during the calibration.
    saturation_counts : int
        Number of counts at which a channel is saturated.
    calibrated_by : "weights" or "plate"
        Whether the unit was calibrated with weights or on a hard plate.
    classes : str
        Ripeness classes, such as `ripe:0.8,unripe` with limits in MPa; empty for none.
    weighed_after_s : float
        Time between hanging a weight and reading it [s]. The stiffnesses and gains hold for this time.
    creep_per_decade, creep_error : float or None
        Measured growth of the compliance per decade of time, and its standard deviation [1]. None means the creep of
        the process.
    force_bend, force_bend_per_N : tuple of float or None
        Relative error of the slope of force against counts at zero force [1], and its change with the force [1/N]. None
        means straight lines.
    deflection_bend, deflection_bend_per_N : tuple of float or None
        The same errors for the compliances 1 / K.
    ball : BallCorrection or None
        Correction by a reference ball.
    scale : FruitScale or None
        Scale that converts the modulus to the firmness that another instrument measures.

    Raises
    ------
    InputError
        If a number is not allowed, or a list does not hold one number per tip.

    Examples
    --------
    >>> report = twintip.read_report(Path("outputs/mine"))  # written by pipeline run
    >>> unit = twintip.calibrate(report, "weights.csv").unit
    >>> unit.tips
    ('low', 'high')
    """

    design: str
    design_sha256: str
    tips: tuple[str, ...]
    method: str
    K_N_per_m: tuple[float, ...] = quantity("N/m", _STIFFNESS, hint=_HINT)
    K_percent: tuple[float, ...] = quantity("%", _SPRING_ERROR, hint=_HINT)
    gain: tuple[float, ...] = quantity("1", _GAIN, hint="a channel that needs no correction has 1")
    gain_percent: tuple[float, ...] = quantity("%", _ERROR, hint=_HINT)
    newtons_per_count: tuple[tuple[float, ...], ...] = ()
    zero_counts: tuple[float, ...] = ()
    saturation_counts: int = 0
    calibrated_by: str = choice(("weights", "plate"), default="weights", hint=_HINT)
    classes: str = ""
    weighed_after_s: float = quantity("s", WEIGHED_AFTER, default=WEIGHED_AFTER_S, hint=_HINT)
    creep_per_decade: float | None = quantity("1", _CREEP, default=None, hint=_HINT)
    creep_error: float | None = quantity("1", _CREEP, default=None, hint=_HINT)
    force_bend: tuple[float, ...] | None = quantity("1", _BEND, default=None, hint=_HINT)
    force_bend_per_N: tuple[float, ...] | None = quantity("1/N", _BEND, default=None, hint=_HINT)
    deflection_bend: tuple[float, ...] | None = quantity("1", _BEND, default=None, hint=_HINT)
    deflection_bend_per_N: tuple[float, ...] | None = quantity("1/N", _BEND, default=None, hint=_HINT)
    ball: BallCorrection | None = None
    scale: FruitScale | None = None

    def __post_init__(self) -> None:
        """Raise InputError for an invalid field, or for a list that does not hold one number per tip.

        The two keys of each pair in `_KEY_PAIRS` must be given together or not at all. If the counts are calibrated,
        their calibration must be complete, as `_check_counts` states.
        """
        check_fields(self, "unit")
        # The firmware contains `method` as a comment, so characters that could end the comment are not allowed.
        if not _SAFE_TEXT.fullmatch(self.method):
            raise validation_error("unit.method", self.method, "", "letters, digits, spaces and , . : ( ) -", _HINT)
        self._check_list_lengths()
        for pair in _KEY_PAIRS:
            missing = [key for key in pair if getattr(self, key) is None]
            given = [key for key in pair if key not in missing]
            if missing and given:
                name = f"unit.{missing[0]}"
                raise validation_error(name, None, "", f"given with {given[0]}", _HINT)
        if self.newtons_per_count or self.zero_counts:
            self._check_counts()

    def _check_list_lengths(self) -> None:
        """Raise InputError if a list of quantities does not hold one number per tip."""
        for item in fields(self):
            values = getattr(self, item.name)
            is_quantity = "bounds" in item.metadata
            if is_quantity and isinstance(values, tuple) and len(values) != len(self.tips):
                bound = f"a list of {len(self.tips)} numbers, one for each tip"
                name = f"unit.{item.name}"
                raise validation_error(name, list(values), "", bound, _HINT)

    def _check_counts(self) -> None:
        """Raise InputError unless the calibration of counts is a square matrix with one zero per channel.

        Its numbers must be finite, and `saturation_counts` must fit into a 32-bit integer of the firmware.
        """
        tip_count = len(self.tips)
        rows = [*self.newtons_per_count, self.zero_counts]  # each must hold one finite number per channel
        numbers = [number for row in rows for number in row]
        is_complete = len(self.newtons_per_count) == tip_count and all(len(row) == tip_count for row in rows)
        has_saturation = 0 < self.saturation_counts <= _LARGEST_COUNT
        if not (is_complete and all(map(math.isfinite, numbers)) and has_saturation):
            bound = (
                f"{tip_count} lists of {tip_count} finite numbers, together with {tip_count} zero_counts "
                f"and saturation_counts of 1 to {_LARGEST_COUNT}"
            )
            raise validation_error("unit.newtons_per_count", str(self.newtons_per_count), "", bound, _HINT)

    def forces_of_counts(self, counts: Sequence[float], tare: Sequence[float]) -> tuple[float, ...]:
        """Return the force of each tip [N] from the counts (channels,) and the tare (channels,)."""
        above_tare = [count - zero for count, zero in zip(counts, tare, strict=True)]
        return tuple(
            math.fsum(slope * count for slope, count in zip(row, above_tare, strict=True))
            for row in self.newtons_per_count
        )

    def measured_creep_or(self, process_creep: CreepLaw) -> CreepLaw:
        """Return the measured creep of the unit, or the creep of its print process if it was not measured."""
        if self.creep_per_decade is None or self.creep_error is None:
            return process_creep
        return CreepLaw(self.creep_per_decade, self.creep_error)

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """Return the stiffness of each spring [N/mm]."""
        return tuple(1e-3 * K for K in self.K_N_per_m)


_KEYS_OF_A_UNIT = {
    "targets": ("P_max", "NL", "NL_definition"),
    "springs": ("K_l_N_per_m", "K_h_N_per_m"),
    "fruit": (
        *("shape", "length_mm", "width_mm", "height_mm", "radius_mm", "radius_across_mm", "azimuth_deg"),
        *("thickness_mm", "poisson", "E_max_MPa", "E_MPa", "skin_mm", "skin_E_MPa", "skin_poisson"),
    ),
    "tips": (
        *("layout", "order", "outer_mm", "shape", "dome_radius_mm", "half_angle_deg", "blunt_mm", "side_mm"),
        *("fillet_mm", "spacing_mm", "offset_mm", "socket"),
    ),
    "press": ("travel_mm",),
    "print": ("process", "E_MPa", "mount", "leaf_thickness_low_mm", "leaf_thickness_high_mm"),
    "readout": (
        *("amplifier", "board", "bits", "full_scale_mV", "rate_Hz", "noise_nV", "delay_ms", "time_error_ms"),
        *("sensitivity_mV_per_mm", "noise_um"),
    ),
}
"""The keys that determine the springs, the tips and the read-out of a unit.

The list must not change, because calibrated units store a digest of these keys and their values.
"""


def design_digest(design: Design) -> str:
    """Return the SHA-256 digest of the part of a design that determines a unit: its springs, tips and read-out.

    Keys that are not set are left out, so that a key of a later version does not change the digest.
    """
    tables = design_as_mapping(design)
    digested = {}
    for table, keys in _KEYS_OF_A_UNIT.items():
        values = {key: tables.get(table, {}).get(key) for key in keys}
        digested[table] = {key: value for key, value in values.items() if value is not None}
    text = json.dumps({**digested, "printer": tables.get("printer", {})}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


_KEYS_BEFORE_STIFFNESS = ("radius_spread", "radius_mm", "radius_across_mm", "thickness_mm", "noise_percent", "noise_N")
_WRITTEN_BY_0_2 = (
    ("press", "strain", "linear", ("attitude",)),
    ("print", "gauges", "none", ("max_length_mm", "E_MPa")),
    ("readout", "transducer", "displacement", ()),
    ("reading", "stiffness_percent", 1.0, _KEYS_BEFORE_STIFFNESS),
    ("reading", "gain_percent", 0.5, (*_KEYS_BEFORE_STIFFNESS, "stiffness_percent")),
)
"""Keys that version 0.2 wrote: the table, the key, its value, and the keys of that table that precede it.

The value is used only if the key is no longer written.
"""

_KEYS_SINCE_0_2 = (
    *("fruit.name", "fruit.roughness_mm", "fruit.roughness_wave_mm", "fruit.flesh_scatter_percent"),
    *("reading.presses", "reading.ball_percent"),
)
"""Keys that were added after version 0.2."""

_FORMER_CALIBRATION_VALUES: dict[str, tuple[object, ...]] = {
    "calibrated_by": ("plate",),
    "stiffness_percent": (1.0,),
    "gain_percent": (0.5, 0.1),
}
"""Values of `reading` that defaults or presets of version 0.2 set for the calibration. They do not affect the print."""


def digests_of_0_2(design: Design) -> set[str]:
    """Return every SHA-256 digest that version 0.2 may have written into a unit of this design.

    The digest of version 0.2 covers the whole design. This includes the calibration keys of `reading`, whose values
    may have changed since, so all combinations of their values are tried. Version 0.2 has no table `bench`, so it is
    left out.
    """
    reading = design.reading
    if reading is None:  # then the design has no bench either
        return {_digest_of_0_2(design)}
    # for each key, its present value and its former values
    choices = [{getattr(reading, key), *former} for key, former in _FORMER_CALIBRATION_VALUES.items()]
    digests = set()
    for values in itertools.product(*choices):
        calibration = dict(zip(_FORMER_CALIBRATION_VALUES, values, strict=True))
        former_design = replace(design, bench=None, reading=replace(reading, **calibration))
        digests.add(_digest_of_0_2(former_design))
    return digests


def _digest_of_0_2(design: Design) -> str:
    """Return the SHA-256 digest of the text that version 0.2 wrote for a design.

    The text is the whole design as TOML, with the keys that version 0.2 wrote and in their order.
    """
    tables = design_as_mapping(design, derived=True)
    for name in _KEYS_SINCE_0_2:
        table, key = name.split(".")
        tables.get(table, {}).pop(key, None)
    for table, key, value, preceding_keys in _WRITTEN_BY_0_2:
        if table in tables and key not in tables[table]:
            tables[table] = _insert_key(tables[table], key, value, preceding_keys)
    return hashlib.sha256(tables_as_toml(tables).encode()).hexdigest()


def _insert_key(
    table: Mapping[str, object], key: str, value: object, preceding_keys: Collection[str]
) -> dict[str, object]:
    """Return a copy of a table with a new key after the last of its `preceding_keys`, or else at the start.

    The position of the key matters, because the order of the keys affects a digest.
    """
    items = list(table.items())
    indices_after = [1 + index for index, (name, _) in enumerate(items) if name in preceding_keys]
    index = max(indices_after, default=0)
    return dict([*items[:index], (key, value), *items[index:]])


def check_weighed_after(name: str, after_s: float | None) -> None:
    """Raise InputError if the time between hanging and reading a weight [s] is implausible; None is allowed.

    `name` is how the message refers to this time.
    """
    if after_s is not None:
        check_number(name, after_s, "s", WEIGHED_AFTER, "weights are read after some 30 s")


def nominal_unit(report: Report) -> PrintedUnit:
    """Return an uncalibrated unit with the springs of its design.

    The stiffnesses have the uncertainty of the print process. The scatter of the process modulus includes creep, so the
    creep of the unit is 0 with no error.
    """
    unit = unit_of(
        report,
        stiffnesses=[1.0 / row[tip] for tip, row in enumerate(report.read_out.springs_mm_per_N)],
        percent=printed_stiffness_percent(report),
        method="nominal: not calibrated, springs as uncertain as their process prints them",
    )
    return replace(unit, creep_per_decade=0.0, creep_error=0.0)


def printed_stiffness_percent(report: Report) -> list[float]:
    """Return the relative standard deviation of each printed spring's stiffness [%], in the order of the tips.

    The stiffness of a leaf is proportional to its modulus and to the third power of its thickness. The scatter of the
    modulus and the accuracy of the thickness are properties of the print process. This accuracy is two standard
    deviations of the thickness.
    """
    design = report.design
    process = design.process
    percent = []
    for thickness in design.tips.each(*process.leaf_thicknesses_mm):  # one thickness [mm] per tip
        thickness_deviation = 0.5 * process.accuracy_mm
        # The factor 3 is the exponent of the thickness.
        thickness_part = 3.0 * thickness_deviation / thickness
        percent.append(100.0 * (thickness_part**2 + process.E_scatter**2) ** 0.5)
    return percent


def unit_of(report: Report, *, stiffnesses: Sequence[float], percent: Sequence[float], method: str) -> PrintedUnit:
    """Return a unit of a report's design with the given springs and uncalibrated channels.

    `stiffnesses` [N/mm] and their standard deviations `percent` [%] hold one value per tip. `method` describes how they
    were measured. The gains are 1. Their standard deviation combines the drift with the error of uncalibrated gains.
    """
    uncalibrated_percent = (report.design.reading or ReadingRequirements()).uncalibrated_gain_percent
    drifts = report.read_out.channels.gain_drift_percent
    return PrintedUnit(
        design=report.design.name,
        design_sha256=design_digest(report.design),
        tips=tuple(tip.name for tip in report.tips),
        method=method,
        K_N_per_m=tuple(1e3 * K for K in stiffnesses),
        K_percent=tuple(percent),
        gain=(1.0,) * len(report.tips),
        # A drift is uniform within its bound, so UNIFORM_DEVIATION turns the bound into a standard deviation.
        gain_percent=tuple(math.hypot(uncalibrated_percent, UNIFORM_DEVIATION * drift) for drift in drifts),
    )


def read_unit(path: Path, report: Report) -> PrintedUnit:
    """Read a unit of a report's design from a unit.toml.

    Raises InputError for an invalid file, for a unit of another design, and for a firmness scale that an older version
    fitted without the correction for creep.
    """
    tables = {key: value for key, value in read_toml(path, "--unit").items() if key not in _FORMER_KEYS}
    try:
        unit = from_plain(PrintedUnit, tables, "unit")
    except ValueError as error:
        # The InputError of a field is nested in an exception group. It already names the field and its bound.
        for cause in _nested_errors(error.__cause__):
            if isinstance(cause, InputError):
                raise cause from error
        bound = f"a unit.toml of pipeline calibrate ({str(error).splitlines()[0]})"
        raise validation_error("--unit", str(path), "", bound, "calibrate the unit") from error
    refuse_other_design(unit, report)
    if unit.scale is not None and "weighed_after_s" not in tables and report.creep.exponent:
        # An older version fitted this scale to readings without the correction for creep. These readings are lower.
        bound = "in a unit with weighed_after_s, because its springs creep"
        raise validation_error("unit.scale", unit.scale.unit, "", bound, "calibrate it again, with --fruit")
    return unit


def _nested_errors(error: BaseException | None) -> Iterator[BaseException]:
    """Yield all exceptions in a nested exception group, or nothing for another exception or None."""
    for nested in getattr(error, "exceptions", ()):
        yield nested
        yield from _nested_errors(nested)


def refuse_other_design(unit: PrintedUnit, report: Report) -> None:
    """Raise InputError if a unit is not of a report's design, or if its ball correction does not fit the report."""
    digest = design_digest(report.design)
    is_of_design = unit.design_sha256 == digest or unit.design_sha256 in digests_of_0_2(report.design)
    if not is_of_design or unit.tips != tuple(tip.name for tip in report.tips):
        bound = f"the unit of design {report.design.name!r} as it is in this folder"
        hint = f"calibrate the unit with this design, whose digest begins with {digest[:12]}"
        raise validation_error("unit.design", f"{unit.design} {unit.design_sha256[:12]}", "", bound, hint)
    if unit.ball is not None and not report.design.takes_ball:
        bound = f"left out, because a ball corrects only {REPRESENTED_BY_BALL}"
        raise validation_error("unit.ball", unit.ball.factor, "", bound, "calibrate the unit")
    if unit.ball is not None:
        _check_ball_lengths(unit.ball, report)


def _check_ball_lengths(ball: BallCorrection, report: Report) -> None:
    """Raise InputError unless a ball correction has one slope per tip and as many form errors as the report.

    If the report has no form errors, because an older version wrote it, their number is not checked.
    """
    tip_count = len(report.tips)
    form_count = max((len(row.form_percent) for row in report.moduli), default=0)
    if form_count == 0:
        form_count = len(ball.form_percent)
    expected_lengths = (
        ("spring_slopes", tip_count, "one for each tip"),
        ("gain_slopes", tip_count, "one for each tip"),
        ("form_percent", form_count, "as form_percent of report.json"),
    )
    for key, count, meaning in expected_lengths:
        values = getattr(ball, key)
        if len(values) != count:
            name, bound = f"unit.ball.{key}", f"a list of {count} numbers, {meaning}"
            raise validation_error(name, list(values), "", bound, _HINT)


def unit_as_toml(unit: PrintedUnit) -> str:
    """Return a unit as the text of a unit.toml, from which `read_unit` restores it.

    Keys without a value are left out. The calibration of the counts is left out too, if there is none.
    """
    omitted = () if unit.zero_counts else ("newtons_per_count", "zero_counts", "saturation_counts")
    given = {key: value for key, value in to_plain(unit).items() if value is not None and key not in omitted}
    return f"# A printed unit, written by pipeline calibrate; pipeline read --unit takes it.\n{tables_as_toml(given)}"
