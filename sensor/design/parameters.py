"""Every number that the user may choose: targets, fruit, tips, press and print.

The records are frozen, and are checked when they are created. Units: mm, N, MPa, degrees; a field whose name ends in
N_per_m is in N/m. The defaults describe the sensor of the paper, which is also designs/paper.toml.
"""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Literal

from sensor.design.bench import Bench
from sensor.design.fruit import Fruit
from sensor.design.processes import PROCESSES, Process
from sensor.design.reading import PRESS_S, ReadingRequirements
from sensor.design.readout import Readout
from sensor.design.tips import REPRESENTED_BY_BALL, PressMotion, Tips, check_tips_on_fruit, represented_by_ball
from sensor.quantity import (
    LENGTH,
    MODULUS,
    Bounds,
    check_choice,
    check_fields,
    choice,
    quantity,
    text_field,
    validation_error,
)
from sensor.theory.two_spring_law import PAPER_SPRINGS, Definition

Mount = Literal["covers", "washers"]

_STIFFNESS = Bounds(at_least=1e-6, at_most=1e9)
# P must rise by more than 0.1 %, the uncertainty of a stiffness. Outside these limits of NL, one spring is ten thousand
# times too stiff or too soft to be made or read.
_FORCE_RATIO = Bounds(at_least=1.001, at_most=100.0)
_NONLINEARITY = Bounds(at_least=1e-5, at_most=0.4999)
_MAX_NAME_LENGTH = 64
_ROUND_OFF = 1e-9  # relative tolerance of the bounds of a time or a thickness


@dataclass(frozen=True, kw_only=True)
class Targets:
    """The targets of the sensor: the largest force ratio and the nonlinearity."""

    P_max: float = quantity(
        "1",
        _FORCE_RATIO,
        default=5.0,
        hint="the paper uses 5",
        meaning="force ratio P on the firmest fruit, `fruit.E_max_MPa`",
    )
    NL: float = quantity(
        "1",
        _NONLINEARITY,
        default=0.05,
        hint="give a fraction: for 5 % write 0.05",
        meaning=(
            "nonlinearity: distance of P from a straight line over E, as a fraction of P_max - 1; for 5 % write 0.05"
        ),
    )
    NL_definition: Definition = choice(
        ("mid-range", "largest"),
        default="mid-range",
        meaning="where the nonlinearity is evaluated: in the middle of the range of E, or where it is largest",
    )

    def __post_init__(self) -> None:
        """Check each field."""
        check_fields(self, "targets")


PAPER_TARGETS = Targets(P_max=5.0, NL=0.05)  # the values in the paper: P_max above its equation (10), NL below (12)


@dataclass(frozen=True, kw_only=True)
class GivenSprings:
    """Springs given by the design, which are judged instead of sized. Either both stiffnesses are given, or neither."""

    K_l_N_per_m: float | None = quantity(
        "N/m",
        _STIFFNESS,
        default=None,
        hint=f"the paper has {1e3 * PAPER_SPRINGS.K_l:g}",
        meaning="stiffness of the low (soft) spring, if you choose it yourself instead of sizing it by the targets",
    )
    K_h_N_per_m: float | None = quantity(
        "N/m",
        _STIFFNESS,
        default=None,
        hint=f"the paper has {1e3 * PAPER_SPRINGS.K_h:g}",
        meaning="stiffness of the high (stiff) spring; give both springs or neither",
    )

    def __post_init__(self) -> None:
        """Check each field. Both stiffnesses must be given, or neither, and the low spring must be the softer one."""
        check_fields(self, "springs")
        K_l = self.K_l_N_per_m
        K_h = self.K_h_N_per_m
        if (K_l is None) != (K_h is None):
            low, high = "springs.K_l_N_per_m", "springs.K_h_N_per_m"
            missing, partner = (low, high) if K_l is None else (high, low)
            raise validation_error(missing, None, "", f"given together with {partner}", "give both or neither")
        if K_l is not None and K_h is not None and K_l >= K_h:
            bound = f"less than springs.K_h_N_per_m = {K_h:g} N/m"
            raise validation_error("springs.K_l_N_per_m", K_l, "N/m", bound, "the low spring must be the softer one")

    @property
    def given(self) -> bool:
        """Return whether the design gives its springs."""
        return self.K_l_N_per_m is not None


_WHOLE_LINES_HINT = "give a whole multiple of the line width of the process"


@dataclass(frozen=True, kw_only=True)
class Print:
    """The print process of the housing, and the parts between which its screws clamp it.

    `process_file` may only be set in a design file, whose reader stores the process in `Design.printer`.
    `E_MPa` is the modulus measured on a printed coupon; without it, the modulus of the process is used.
    """

    process: str = choice(
        tuple(PROCESSES),
        default="fdm-petg",
        meaning="print process of the housing, see [processes](design-file.md#print-processes)",
    )
    process_file: str | None = text_field(
        default=None,
        hint="the path of a TOML file",
        meaning=(
            "a TOML file with a printer of your own; the path is relative to the design file, see "
            "[processes](design-file.md#a-printer-of-your-own)"
        ),
    )
    max_length_mm: float = quantity(
        "mm",
        LENGTH,
        default=120.0,
        hint="give the length of the longest leaf that fits into the machine",
        meaning="length of the longest leaf that fits into the machine",
    )
    E_MPa: float | None = quantity(
        "MPa",
        MODULUS,
        default=None,
        hint="give the modulus measured on the coupon",
        meaning="modulus that you measured on a printed coupon; replaces the modulus of the process",
    )
    mount: Mount = choice(
        ("covers", "washers"),
        default="covers",
        meaning=("parts that clamp the frame at its screws: the two covers, or a washer on each side of each hole"),
    )
    leaf_thickness_low_mm: float | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint=_WHOLE_LINES_HINT,
        meaning=("leaf thickness of the low spring, a whole number of printed lines; by default from the process"),
    )
    leaf_thickness_high_mm: float | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint=_WHOLE_LINES_HINT,
        meaning=("leaf thickness of the high spring, a whole number of printed lines; by default from the process"),
    )

    def __post_init__(self) -> None:
        """Check each field except the process, which `Design` checks because it also needs `Design.printer`."""
        check_fields(self, "print", excluded=("process",))
        if self.process_file is not None:
            bound = "left out here, because a process file is read together with a design file"
            raise validation_error(
                "print.process_file", self.process_file, "", bound, "call load_design, or give Design.printer"
            )


def _is_whole_lines(thickness: float, line_width: float) -> bool:
    """Return whether a thickness [mm] is a whole multiple of the line width [mm], and at least one line."""
    lines = max(1, round(thickness / line_width))
    return abs(thickness - lines * line_width) <= _ROUND_OFF * thickness


_HOUSING_KEYS = ("press.attitude", "print.max_length_mm", "print.E_MPa", "print.mount")
"""Keys that have an effect only if the sensor has a housing."""


@dataclass(frozen=True, kw_only=True)
class Design:
    """A whole design: the targets of the sensor, its fruit, tips, press and print process.

    `docs/design-file.md` lists the keys of each table with their units and bounds.

    Attributes
    ----------
    name : str
        Name of the design, which is shown in all output.
    targets : Targets or None
        Force ratio P_max and nonlinearity NL for which the springs are sized. Without targets, both are results.
    springs : GivenSprings
        Spring stiffnesses [N/m], if they are given instead of sized.
    fruit : Fruit
        Shape, size [mm] and moduli [MPa] of the fruit.
    tips : Tips
        Layout, shape and size [mm] of the tips.
    press : PressMotion
        Travel [mm] and tilt [deg] of the press.
    reading : ReadingRequirements or None
        Limits for the error of the modulus that is read, and the scatter of fruit and poses.
    readout : Readout or None
        Amplifier and board that measure the deflections.
    bench : Bench or None
        Balance and dial for the calibration of a unit.
    print : Print
        Print process, and dimensions of the printed housing.
    printer : Process or None
        A custom process. Its name must be `print.process`.

    Raises
    ------
    InputError
        If a value is not allowed, or contradicts another value.

    Examples
    --------
    >>> twintip.load_design("mango").tips.layout
    'square'
    """

    name: str = "paper"
    targets: Targets | None = field(default_factory=Targets)
    springs: GivenSprings = field(default_factory=GivenSprings)
    fruit: Fruit = field(default_factory=Fruit)
    tips: Tips = field(default_factory=Tips)
    press: PressMotion = field(default_factory=PressMotion)
    reading: ReadingRequirements | None = None
    readout: Readout | None = None
    bench: Bench | None = None
    print: Print = field(default_factory=Print)
    printer: Process | None = None

    def __post_init__(self) -> None:
        """Raise InputError for an invalid name, or if the tables contradict each other.

        Each table has already checked its own keys. The process is checked first, because other checks use it.
        """
        has_valid_characters = self.name.replace("-", "").replace("_", "").isalnum() and self.name.isascii()
        if not has_valid_characters or len(self.name) > _MAX_NAME_LENGTH:
            bound = f"1 to {_MAX_NAME_LENGTH} letters, digits, - or _"
            hint = 'write for instance name = "mine" in the design file, or give the file such a name'
            raise validation_error("name", self.name, "", bound, hint)
        self._check_process()
        self._check_leaf_thicknesses()
        self._check_tip_shape()
        check_tips_on_fruit(self.fruit, self.tips)
        depth = self.fruit.depth_mm
        if self.press.travel_mm >= depth:
            bound = f"less than {self.fruit.depth_key} = {depth:g} mm"
            raise validation_error("press.travel_mm", self.press.travel_mm, "mm", bound, "press less deeply")
        self._check_springs_are_known()
        self._check_keys_replaced_by_reading()
        self._check_keys_without_effect()
        self._check_ranges_of_reading()
        self._check_time()
        self._check_ball()
        self._check_bench()
        self._check_readout()

    def _check_process(self) -> None:
        """Raise InputError unless the process is a known process or the custom process of the design."""
        name = self.print.process
        printer = self.printer
        if printer is None:
            check_choice("print.process", name, Print)
        elif printer.name != name or name in PROCESSES:
            bound = (
                f"the name of the design's own process, {printer.name!r}, which must not be the name of a known process"
            )
            raise validation_error("print.process", name, "", bound, "give both the same new name, or drop [printer]")

    def _check_leaf_thicknesses(self) -> None:
        """Raise InputError for a leaf thickness that the process cannot print.

        A thickness must be a whole number of printed lines, if the process prints lines. The thickness must be large
        enough to be printed accurately, and small enough to leave a gap between the two leaves.
        """
        for key in ("leaf_thickness_low_mm", "leaf_thickness_high_mm"):
            thickness = getattr(self.print, key)
            if thickness is not None:
                self._check_leaf_thickness(f"print.{key}", thickness)

    def _check_leaf_thickness(self, name: str, thickness: float) -> None:
        """Raise InputError if the process cannot print leaves of this thickness [mm]. `name` is TABLE.KEY."""
        process = self._process_as_listed  # without the leaf thicknesses that are checked here
        line_width = process.line_width_mm  # None if the process prints no lines
        max_thickness = self.tips.tip_layout.leaf_separation_mm - 2.0 * process.fillet_mm
        hint = "leave it out to use the thickness of the process"
        if line_width is not None and not _is_whole_lines(thickness, line_width):
            lines = max(1, math.floor(thickness / line_width))
            bound = f"a whole number of lines of {line_width:g} mm, as {process.name} prints"
            hint = f"choose {lines * line_width:g} or {(lines + 1) * line_width:g} mm"
            raise validation_error(name, thickness, "mm", bound, hint)
        if thickness < process.thinnest_leaf_mm:
            min_thickness = process.thinnest_leaf_mm
            bound = f"at least {min_thickness:.4g} mm, as {process.name} is accurate to {process.accuracy_mm:g} mm"
            raise validation_error(name, thickness, "mm", bound, hint)
        if thickness >= max_thickness:
            bound = f"less than {max_thickness:g} mm, the distance between the two leaves minus their fillets"
            raise validation_error(name, thickness, "mm", bound, hint)

    @property
    def process(self) -> Process:
        """Return the process of the housing, with the modulus and the leaf thicknesses that the design overrides."""
        keys = ("E_MPa", "leaf_thickness_low_mm", "leaf_thickness_high_mm")
        values = {key: getattr(self.print, key) for key in keys}
        overrides = {key: value for key, value in values.items() if value is not None}
        return dataclasses.replace(self._process_as_listed, **overrides) if overrides else self._process_as_listed

    @property
    def _process_as_listed(self) -> Process:
        """Return the custom process of the design or the known process, before [print] overrides its numbers."""
        return self.printer or PROCESSES[self.print.process]

    def _check_tip_shape(self) -> None:
        """Raise InputError if a tip is printed and its shape cannot be printed. A ground pin may have any shape."""
        tips = self.tips
        if tips.socket == "pin" or tips.tip_shape.is_printed:
            return
        hint = "choose tips.socket = 'pin', a ground pin of this shape"
        if tips.fillet_mm and dataclasses.replace(tips, fillet_mm=0.0).tip_shape.is_printed:
            bound = f"0 if {self.process.name} prints the tips, whose edges are sharp"
            raise validation_error("tips.fillet_mm", tips.fillet_mm, "mm", bound, hint)
        bound = f"'cube' or 'dome' if {self.process.name} prints the tips"
        raise validation_error("tips.shape", tips.shape, "", bound, hint)

    def _check_keys_replaced_by_reading(self) -> None:
        """Raise InputError for keys that have no effect in a design with [reading].

        These keys are the tilt and the roll of the press, and the targets if the springs are given.
        """
        if self.reading is None:
            return
        for name, tilt in (("press.tilt_deg", self.press.tilt_deg), ("press.roll_deg", self.press.roll_deg)):
            if tilt != 0.0:
                raise validation_error(
                    name, tilt, "deg", "0 if the design has [reading]", "reading.tilt_deg bounds the tilt of a press"
                )
        if self.targets is not None and self.springs.given:
            bound = "left out if [springs] and [reading] are given"
            raise validation_error("targets.P_max", self.targets.P_max, "1", bound, "[targets] would have no effect")

    def _check_keys_without_effect(self) -> None:
        """Raise InputError for a key that is set but has no effect in this design.

        The default value is allowed, because a design file that the program writes contains it. The value 0 is allowed
        too.
        """
        for name, (reason, hint) in self._keys_without_effect.items():
            table, _, key = name.partition(".")
            record = getattr(self, table)
            declared = record.__dataclass_fields__[key]
            value = getattr(record, key)
            if value not in (declared.default, 0.0):
                raise validation_error(name, value, declared.metadata.get("unit", ""), f"left out {reason}", hint)

    @property
    def _keys_without_effect(self) -> dict[str, tuple[str, str]]:
        """Return the keys TABLE.KEY that have no effect in this design, each with the reason and a hint."""
        fruit = self.fruit
        reading = self.reading
        ineffective = {}
        if fruit.skin_mm is None:
            ineffective["fruit.skin_poisson"] = ("without fruit.skin_mm", "drop it, or give a skin")
        if fruit.thickness_mm is not None:
            ineffective["fruit.height_mm"] = ("because fruit.thickness_mm replaces it", "drop one of the two")
        if reading is not None:
            hint = "reading.tilt_deg bounds the tilt of a press"
            ineffective["press.tilt_spread_deg"] = ("if the design has [reading]", hint)
            if fruit.radius_mm is None:
                ineffective["reading.radius_spread"] = ("for fruit.shape = 'block'", "a flat fruit has no radius")
            elif reading.radius_mm is not None:
                ineffective["reading.radius_spread"] = ("if reading.radius_mm is given", "drop one of the two")
        if not self.tips.tip_layout.has_housing:
            reason = f"for tips.layout = {self.tips.layout!r}, which has no housing"
            ineffective |= dict.fromkeys(_HOUSING_KEYS, (reason, "drop it, or choose another layout"))
        return ineffective

    def _check_ranges_of_reading(self) -> None:
        """Raise InputError for ranges in [reading] that this fruit or these tips do not allow.

        A range of radii requires a piece of an ellipsoid. A range of the flesh thickness requires domes on a curved
        fruit. A list of limits must have one limit per modulus of the fruit.
        """
        reading = self.reading
        if reading is None:
            return
        fruit = self.fruit
        if reading.radius_mm is not None and fruit.shape != "ellipsoid":
            bound = f"left out for fruit.shape = {fruit.shape!r}"
            hint = "choose fruit.shape = 'ellipsoid', or give reading.radius_spread"
            raise validation_error("reading.radius_mm", list(reading.radius_mm), "mm", bound, hint)
        if reading.radius_mm is not None and fruit.is_whole:
            bound = "given with fruit.width_mm and reading.radius_mm, because only a piece of a fruit can be turned"
            raise validation_error("fruit.length_mm", None, "mm", bound, "give both, about 4 tips.spacing_mm each")
        has_domes = self.tips.dome_radius_mm is not None
        if reading.thickness_mm is not None and not (has_domes and fruit.radius_mm is not None):
            bound = "left out unless the tips are domes on a sphere or an ellipsoid"
            hint = "drop it, or choose these shapes"
            raise validation_error("reading.thickness_mm", list(reading.thickness_mm), "mm", bound, hint)
        self._check_number_of_limits(reading)

    def _check_number_of_limits(self, reading: ReadingRequirements) -> None:
        """Raise InputError if [reading] has a list of uncertainty limits that is not as long as the list of moduli."""
        limits = reading.uncertainty_limit
        moduli = self.fruit.E_MPa
        if isinstance(limits, tuple) and len(limits) != len(moduli):
            bound = f"one number, or a list of {len(moduli)}, one for each of fruit.E_MPa"
            raise validation_error(
                "reading.uncertainty_limit", list(limits), "1", bound, "give as many limits as moduli"
            )

    def _check_readout(self) -> None:
        """Raise InputError if a read-out has a wrong number of delays, or if its temperature drift is unknown.

        The drift is unknown if the process has no temperature coefficient of the modulus.
        """
        if self.readout is None:
            return
        delays = self.readout.delay_ms
        if delays is not None and len(delays) != len(self.tips.springs):
            bound = f"a list of {len(self.tips.springs)} numbers, one for each tip"
            raise validation_error("readout.delay_ms", list(delays), "ms", bound, "write them in the order of the tips")
        if self.process.E_per_K is None:
            raise validation_error(
                "printer.E_per_K", None, "1/K", "given if the design has [readout]", "a plastic usually has 0.003"
            )

    def _check_ball(self) -> None:
        """Raise InputError for a reference ball, unless presses on a ball represent presses on the fruit."""
        if self.reading is not None and self.reading.calibrated_by == "ball" and not self.takes_ball:
            bound = f"'weights' or 'plate', because a ball can only be used for {REPRESENTED_BY_BALL}"
            raise validation_error("reading.calibrated_by", "ball", "", bound, "choose plate")

    @property
    def expected_bench(self) -> Bench | None:
        """Return the bench that will calibrate a unit, or None without `[reading]`, which needs no calibration."""
        return None if self.reading is None else self.bench or Bench()

    def _check_bench(self) -> None:
        """Raise InputError for a bench that has no effect.

        A bench has no effect without a reading, or if the reading states the uncertainties that follow from a bench.
        """
        bench = self.bench
        if bench is None:
            return
        reading = self.reading
        if reading is None:
            bound = "left out without [reading]"
            raise validation_error("bench.balance_g", bench.balance_g, "g", bound, "drop [bench], or give [reading]")
        if reading.stiffness_percent is not None and reading.gain_percent is not None:
            bound = "left out if reading.stiffness_percent and reading.gain_percent are given, which replace [bench]"
            raise validation_error("bench.balance_g", bench.balance_g, "g", bound, "drop [bench], or drop both keys")

    @property
    def takes_ball(self) -> bool:
        """Return whether presses on a reference ball, which has no skin, represent presses on the fruit."""
        return represented_by_ball(self.fruit, self.tips)

    @property
    def without_relaxation(self) -> "Design":
        """Return the same design for elastic flesh, which does not relax. A reference ball, for example, is elastic."""
        return dataclasses.replace(
            self,
            fruit=dataclasses.replace(self.fruit, relaxation=None),
            press=dataclasses.replace(self.press, speed_mm_per_s=None, hold_s=None),
            reading=None if self.reading is None else dataclasses.replace(self.reading, at_s=None),
        )

    def _check_time(self) -> None:
        """Raise InputError if the times of a press are given for elastic flesh, or are missing for flesh that relaxes.

        The time of the reading must be during the hold.
        """
        reading_s = None if self.reading is None else self.reading.at_s
        press_times = {"press.speed_mm_per_s": self.press.speed_mm_per_s, "press.hold_s": self.press.hold_s}
        if self.fruit.relaxation is None:
            for name, value in {**press_times, "reading.at_s": reading_s}.items():
                if value is not None:
                    hint = "drop it, or give the relaxation of the flesh"
                    raise validation_error(name, value, "", "left out without fruit.relaxation", hint)
            return
        for name, value in press_times.items():
            if value is None:
                hint = "give the speed and the hold of the press"
                raise validation_error(name, None, "", "given together with fruit.relaxation", hint)
        earliest, latest = (1.0 - _ROUND_OFF) * self.stop_s, (1.0 + _ROUND_OFF) * self.release_s
        if reading_s is not None and not earliest <= reading_s <= latest:
            bound = f"from {self.stop_s:g} s, when the press stops, to {self.release_s:g} s, when it is released"
            raise validation_error("reading.at_s", reading_s, "s", bound, "hold for longer, or press faster")

    @property
    def stop_s(self) -> float:
        """Return the time from the first touch to the stop of the press [s], or 0 if no speed is given."""
        speed = self.press.speed_mm_per_s
        return 0.0 if speed is None else self.press.travel_mm / speed

    @property
    def press_s(self) -> float:
        """Return the duration of a press from the first touch to the stop [s].

        If the design gives no speed, a press by hand is assumed.
        """
        return self.stop_s or PRESS_S  # stop_s is 0 if no speed is given

    @property
    def release_s(self) -> float:
        """Return the time from the first touch to the release of the press [s]."""
        return self.stop_s + (self.press.hold_s or 0.0)  # 0 if no hold is given

    @property
    def read_s(self) -> float:
        """Return the time from the first touch to the reading of the forces [s], by default the time of the stop."""
        at = None if self.reading is None else self.reading.at_s
        return self.stop_s if at is None else min(max(at, self.stop_s), self.release_s)

    def _check_springs_are_known(self) -> None:
        """Raise InputError unless the springs are given, or can be sized by targets. Targets can size only a pair."""
        takes_targets = self.tips.tip_layout.takes_targets
        if self.springs.given or (self.targets is not None and takes_targets):
            return
        reason = "if no targets size the springs" if takes_targets else f"for tips.layout = {self.tips.layout!r}"
        raise validation_error(
            "springs.K_l_N_per_m", None, "", f"given {reason}", "give both stiffnesses in [springs], in N/m"
        )

    @property
    def nominal_targets(self) -> Targets:
        """Return the targets, or the default targets if the design has none.

        The definition of NL in the default targets then applies to the results.
        """
        return self.targets or Targets()

    @property
    def as_pair(self) -> "Design":
        """Return the design with a pair of tips, one low and one high, both carried by a single plate.

        The pair has no read-out, because the channels of a read-out belong to all tips of the layout.
        """
        reading = self.reading
        if reading is not None and reading.calibrated_by == "ball":  # a ball cannot calibrate a pair
            reading = dataclasses.replace(reading, calibrated_by="plate")
        return dataclasses.replace(self, tips=self.tips.as_pair, readout=None, reading=reading)

    @property
    def has_paper_scene(self) -> bool:
        """Return whether the fruit and the tips equal those in the paper. The moduli and the press may differ."""
        ignored = ("name", "E_MPa", "bruise_limit_MPa", "poisson_spread", "relaxation", "gap_mm", "socket")
        return all(
            getattr(own, item.name) == getattr(paper, item.name)
            for own, paper in ((self.fruit, Fruit()), (self.tips, Tips()))
            for item in dataclasses.fields(own)
            if item.name not in ignored
        )

    @property
    def full_travels_mm(self) -> tuple[float, float]:
        """Return the largest travel [mm] of a low tip and of a high tip at the end of a press.

        A travel is negative if none of these tips touches the fruit. The tilt of the press lowers one side. If the
        design has a reading, the travel starts at the first touch in the pose of the press. The change of the tilt
        during the press, in any direction, then adds to the travel of the outermost tips. Its largest effect is assumed
        for all tips.
        """
        centres = self.tips.centres_mm
        slope = math.tan(math.radians(self.press.tilt_deg))
        middle = sum(centres) / len(centres)
        travel_of_tilt_change = 0.0
        if self.reading is not None:
            max_distance = max(math.hypot(x - middle, y) for x, y in self.tips.places_mm)
            travel_of_tilt_change = max_distance * math.tan(math.radians(self.reading.tilt_change_deg))
        travels = [self.press.travel_mm + travel_of_tilt_change + (x - middle) * slope for x in centres]
        groups = self.tips.spring_groups
        return max(travels[tip] for tip in groups.low), max(travels[tip] for tip in groups.high)


TABLES = tuple(item.name for item in dataclasses.fields(Design) if item.name != "name")
