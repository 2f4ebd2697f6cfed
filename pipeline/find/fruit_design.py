"""A sensor for a given fruit: the preset of the most similar fruit, scaled to the fruit's size and firmness.

Contact has no length and no modulus of its own. So a sensor reads as well if its lengths are proportional to the
fruit's radius, and its springs to radius times modulus. Steps take care of what does not scale: rounded sizes, the
bruise limit, the hand's distance from the centre, and what can be printed.
"""

import math

from pipeline.find.candidate import Candidate
from pipeline.find.changes import Changes, change_design, in_words, value_of
from pipeline.find.fruit_range import Ends, FruitRange, bruise_limit
from pipeline.find.proved_candidate import first_proved
from pipeline.find.suggestion import Suggestion
from pipeline.options import RunOptions, load_design
from pipeline.reading.reading_records import CalibrationLeft
from pipeline.result import SensorResult
from pipeline.sensor import Sensor
from pipeline.storage.stopwatch import Progress, silent
from pipeline.verdicts.hints import least_travel
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.quantity import InputError
from sensor.verdict import row_of
from sensor.words import rounded

PRESETS = ("apple", "avocado", "kiwi", "mango", "orange", "peach", "pear", "plum", "tomato")
"""Sensors for single fruits, all of which pass."""

MOST_TRIALS = 30
MOST_RUNS = 4
TOLERANCE = 0.01  # tolerance of the springs, whose contact is then accurate enough for the error bars of readings
_LEAST_SPACING_MM = 4.5  # smaller sensors have shallower leaves, which a tilted fruit pushes sideways
_BEYOND_SIDE_MM = 0.5  # gap between neighbouring tips, as in the presets
_OF_DEPTH = 0.6  # depth of the corners of the piece of fruit below its top, as a fraction of the depth of the flesh
_OF_THINNEST = 0.9  # the same for the roundest fruit with the thinnest flesh, whose skin the corners must reach too
_HALF_MM = 0.5
_DOME_STEP_MM = 0.1
_SPACING_STEP_MM = 0.05
_TRAVEL_STEP_MM = 0.01
_LESS_TRAVEL_MM = 0.02  # step of the travel that reduces the largest bias of both signs
_SOFTER = 0.9  # factor on both springs against bruises
_BY_BIAS = 1.04  # first factor on the radii of the design's fruit
_BEYOND_LIMIT = 1.05  # factor on the change that a part of the error needs, because it is not the whole error
_STIFFER_AT_ONCE = 1.5  # largest such change in one step; further steps follow
_STIFFER = 1.12  # factor on the high spring that improves readings of firm fruit


def most_alike(fruit: FruitRange) -> str:
    """Return the preset whose fruit has the least `_unlikeness` to a fruit."""
    return min(PRESETS, key=lambda name: _unlikeness(fruit, fruit_of(load_design(name))))


def fruit_of(design: Design) -> FruitRange:
    """Return the range of fruits of a design; its own dimensions if it gives no range."""
    own = design.fruit
    asked = design.reading or ReadingRequirements()
    along, across = own.radii_mm
    return FruitRange(
        name=own.name,
        radius_mm=asked.radius_mm or (along, along),
        radius_across_mm=asked.radius_across_mm or (across, across),
        thickness_mm=asked.thickness_mm or (own.depth_mm, own.depth_mm),
        E_min_MPa=min(own.E_MPa),
        E_max_MPa=own.E_max_MPa,
    )


def _unlikeness(fruit: FruitRange, other: FruitRange) -> float:
    """Return the sum of squared log ratios [1] of mean radii, moduli and flesh, if its thickness is known."""
    ratios = [fruit.E_min_MPa / other.E_min_MPa, fruit.E_max_MPa / other.E_max_MPa]
    for own, of_other in zip(sorted(map(_middle, fruit.radii_mm)), sorted(map(_middle, other.radii_mm)), strict=True):
        ratios.append(own / of_other)
    if fruit.thickness_mm is not None and other.thickness_mm is not None:
        ratios.append(_middle(fruit.thickness_mm) / _middle(other.thickness_mm))
    return math.fsum(math.log(ratio) ** 2 for ratio in ratios)


def _middle(ends: Ends) -> float:
    return math.sqrt(ends[0] * ends[1])


def scaled_changes(fruit: FruitRange, preset: Design) -> Changes:
    """Return the changes that adapt a preset to a fruit, rounded to sizes that a maker can measure."""
    tips = preset.tips
    preset_fruit = preset.fruit
    preset_range = fruit_of(preset)
    moduli = fruit.moduli_MPa
    # The sensor is scaled with the fruit, but not below the least spacing of the tips.
    smallest = min(1.0, _LEAST_SPACING_MM / tips.spacing_mm)
    length_ratio = max(preset_range.mean_curvature / fruit.mean_curvature, smallest)
    modulus_ratio = _middle_modulus(fruit) / _middle_modulus(preset_range)
    spacing = _nearest(tips.spacing_mm * length_ratio, _SPACING_STEP_MM)
    # The fruit of the design takes the same position in its range as the fruit of the preset.
    radii = []
    for ends, of_preset, ends_of_preset in zip(
        fruit.radii_mm, preset_fruit.radii_mm, preset_range.radii_mm, strict=True
    ):
        radii.append(_same_position_in_range(ends, of_preset, ends_of_preset))
    depth = _nearest(preset_fruit.depth_mm * length_ratio, _HALF_MM)
    if fruit.thickness_mm is not None and preset_range.thickness_mm is not None:
        depth = _same_position_in_range(fruit.thickness_mm, preset_fruit.depth_mm, preset_range.thickness_mm)
    widest_side = min(_widest_piece(radii[0], radii[1], _OF_DEPTH * depth), _widest_piece_met(fruit, depth))
    return {
        "fruit.thickness_mm": depth,
        "fruit.radius_mm": radii[0],
        "fruit.radius_across_mm": radii[1],
        "reading.radius_mm": fruit.radii_mm[0],
        "reading.radius_across_mm": fruit.radii_mm[1],
        "reading.thickness_mm": fruit.thickness_mm,
        "fruit.length_mm": _nearest(min(preset_fruit.length_mm * length_ratio, widest_side), _HALF_MM),
        "fruit.width_mm": _nearest(min(preset_fruit.width_mm * length_ratio, widest_side), _HALF_MM),
        "fruit.E_max_MPa": fruit.E_max_MPa,
        "fruit.E_MPa": moduli,
        "fruit.name": fruit.name,
        "fruit.bruise_limit_MPa": tuple(bruise_limit(E, fruit.name) for E in moduli),
        "tips.spacing_mm": spacing,
        "tips.side_mm": round(spacing - _BEYOND_SIDE_MM, 2),
        "tips.dome_radius_mm": _nearest((tips.dome_radius_mm or 0.0) * length_ratio, _DOME_STEP_MM),
        "press.travel_mm": max(least_travel(preset), _nearest(preset.press.travel_mm * length_ratio, _TRAVEL_STEP_MM)),
        # springs scale as length times modulus
        **_springs(preset, length_ratio * modulus_ratio, length_ratio * modulus_ratio),
    }


def _middle_modulus(fruit: FruitRange) -> float:
    """Return the geometric mean of the softest and the firmest flesh [MPa]."""
    return math.sqrt(fruit.E_min_MPa * fruit.E_max_MPa)


def _widest_piece(radius: float, radius_across: float, fall: float) -> float:
    """Return the side of a square piece of an ellipsoid [mm] whose corners are at most `fall` [mm] below its apex.

    The principal radii [mm] are along the sides. A corner (h, h) lies below the apex by a fall with (1 - fall / R)^2 =
    1 - h^2 / R^2 - h^2 / (R R_across), as in `Fruit.fall_mm`. Corners beyond 0.6 R are not on the cap of the fruit.
    """
    level = (1.0 - min(fall / radius, _OF_DEPTH)) ** 2
    return 2.0 * radius * math.sqrt((1.0 - level) / (1.0 + radius / radius_across))


def _widest_piece_met(fruit: FruitRange, depth: float) -> float:
    """Return the side of a piece whose corners lie on every fruit of the range, at any azimuth [mm].

    The worst case is the roundest fruit with the thinnest flesh, or with `depth` [mm] if no range is known. Its most
    curved section may lie along a diagonal, where a corner is as deep as on a ball.
    """
    roundest = min(radius for ends in fruit.radii_mm for radius in ends)
    thinnest = depth if fruit.thickness_mm is None else fruit.thickness_mm[0]
    return _widest_piece(roundest, roundest, _OF_THINNEST * thinnest)


def _same_position_in_range(ends: Ends, of_preset: float, ends_of_preset: Ends) -> float:
    """Return the length at the same position in its range as the preset's, rounded to three digits [mm].

    If the preset's length is beyond an end, the result exceeds the same end by the same factor.
    """
    least, most = ends_of_preset
    if of_preset <= least:
        return rounded(ends[0] * of_preset / least)
    if of_preset >= most:
        return rounded(ends[1] * of_preset / most)
    fraction = math.log(of_preset / least) / math.log(most / least)
    return rounded(ends[0] * (ends[1] / ends[0]) ** fraction)


def fruit_suggestion(
    fruit: FruitRange, preset: Design, fixed: frozenset[str] = frozenset(), progress: Progress = silent
) -> Suggestion:
    """Return a preset adapted to a fruit that passes its run; the keys in `fixed` do not change.

    If none passes, the verdicts are of the nearest design. Raises InputError if fruit and preset make no design,
    MeshError or SolveError.
    """
    changes: Changes = {
        key: value
        for key, value in scaled_changes(fruit, preset).items()
        if key not in fixed and value != value_of(preset, key)
    }
    design = change_design(preset, changes)
    runs = 0
    seen: set[Design] = set()
    tried: list[Candidate] = []
    result: Sensor | SensorResult | None
    centring = _Centring()
    while len(seen) < MOST_TRIALS and runs < MOST_RUNS and design not in seen:
        seen.add(design)
        result = _sized(design)
        candidate = _candidate(changes, result)
        # A scaled preset passed its own run, whose exact springs may decide verdicts that sized springs leave
        # undecided.
        if candidate.passes or (not tried and not _is_refused(candidate)):
            progress("runs the design that passes with springs as they were sized")
            runs += 1
            result = _run(preset, candidate)
            candidate = _candidate(changes, result)
            if result is not None and result.passed:
                return Suggestion(design=preset, changes=changes, verdicts=result.verdicts, tried=len(seen), runs=runs)
        tried.append(candidate)
        step = _next_step(design, result, centring)
        if not step or not fixed.isdisjoint(step):
            break
        progress(f"tries design {len(seen) + 1} of at most {MOST_TRIALS}: {in_words(step)}")
        changes = {**changes, **step}
        design = change_design(preset, changes)
    nearest = min(tried, key=lambda candidate: candidate.shortfall)
    reason = f"none found: of {len(seen)} designs around the preset none passes; the nearest has the verdicts below"
    verdicts = nearest.verdicts or ()
    return Suggestion(design=preset, changes=None, verdicts=verdicts, reason=reason, tried=len(seen), runs=runs)


class _Centring:
    """The next factor [1] on the radius of the design's fruit: a bisection of its logarithm.

    The largest bias has one sign if that fruit is too flat, and the other if it is too round. A step beyond the best
    radius changes the sign; from then on steps are half as long in the logarithm.
    """

    def __init__(self) -> None:
        """Begin with the longest step, before any failing bias."""
        self.factor = _BY_BIAS
        self._last_bias = 0.0

    def passes_over(self, bias: float) -> bool:
        """Record the failing bias of the next design, 0 for none; if its sign changed, halve the step and return True.

        A design without a failing bias leaves the last sign unchanged.
        """
        has_changed = bias * self._last_bias < 0.0
        if has_changed:
            self.factor = math.sqrt(self.factor)
        self._last_bias = bias or self._last_bias
        return has_changed


def _next_step(design: Design, result: Sensor | SensorResult | None, centring: _Centring) -> Changes:
    """Return the next change of a judged design from `_step`.

    If the bias changed its sign, the press is shallower too.
    """
    failed = _failed(result)
    is_between = centring.passes_over(_failing_bias(result, failed))
    step = _step(design, result, failed, centring.factor)
    if not is_between:
        return step
    less = round(design.press.travel_mm - _LESS_TRAVEL_MM, 2)
    return {**step, "press.travel_mm": max(least_travel(design), less)}


def _candidate(changes: Changes, result: Sensor | SensorResult | None) -> Candidate:
    """Return the candidate of some changes with the verdicts of its result, or without verdicts."""
    return Candidate(changes=changes, verdicts=None if result is None else result.verdicts)


def _run(preset: Design, candidate: Candidate) -> SensorResult | None:
    """Return the result of the run of a candidate; None if it is refused or cannot be solved."""
    proof = first_proved([candidate], lambda one: change_design(preset, one.changes), RunOptions(), 1)
    return None if proof is None else proof.result


def _sized(design: Design) -> Sensor | None:
    """Return the judged sensor on springs as sized; None if a level press leaves the face of a dome."""
    sensor = Sensor(design=design, options=RunOptions(tolerance=TOLERANCE), springs_as="sized")
    try:
        sensor.solve("verdicts")
    except InputError as error:
        if error.field != "tips.side_mm":
            raise
        return None
    return sensor


def _is_refused(candidate: Candidate) -> bool:
    """Return whether a verdict on the candidate fails beyond its error bar, or there are no verdicts."""
    return candidate.verdicts is None or any(verdict.passed is False for verdict in candidate.verdicts)


def _failed(result: Sensor | SensorResult | None) -> set[str]:
    """Return the names of the verdicts that did not pass, or else of those that passed without their margin."""
    candidate = _candidate({}, result)
    not_passed = {verdict.name for verdict in candidate.verdicts or () if verdict.passed is not True}
    return not_passed or {verdict.name for verdict in candidate.failed}


def _failing_bias(result: Sensor | SensorResult | None, failed: set[str]) -> float:
    """Return the largest bias [1] if its verdict failed, positive for fruit read too firm; else 0."""
    readings = None if result is None else result.readings
    if readings is None or not readings.moduli or "reading.bias" not in failed:
        return 0.0
    return readings.worst_bias.bias.value


def _step(design: Design, result: Sensor | SensorResult | None, failed: set[str], centring: float) -> Changes:
    """Return the change that brings a design nearer to passing, in measurable steps; empty if no rule applies.

    `centring` is the factor [1] that makes the fruit of the design flatter; its inverse makes it rounder.
    """
    readings = None if result is None else result.readings
    runs_off_face = readings is not None and readings.face_mm > design.tips.side_mm
    if result is None or runs_off_face or "geometry.tip_face" in failed:
        return {"tips.dome_radius_mm": round((design.tips.dome_radius_mm or 0.0) - _HALF_MM, 1)}
    if "bruise" in failed:
        return _springs(design, _SOFTER, _SOFTER)
    if "reading.touch" in failed or (readings is not None and readings.refused is not None):
        return {"press.travel_mm": round(design.press.travel_mm + _TRAVEL_STEP_MM, 2)}
    if "reading.calibration" in failed and readings is not None and readings.calibration is not None:
        return _as_calibrated(design, readings.calibration)
    bias = _failing_bias(result, failed)
    if bias:
        return _centred(design, centring if bias > 0.0 else 1.0 / centring)
    if "reading.uncertainty" in failed:
        return {"springs.K_h_N_per_m": _springs(design, 1.0, _STIFFER)["springs.K_h_N_per_m"]}
    return {}


def _as_calibrated(design: Design, left: CalibrationLeft) -> Changes:
    """Return the change against the calibration error: a stiffer spring for the balance, more travel for the dial."""
    limit = row_of("reading.calibration").limit
    over = left.largest_stiffness / limit if isinstance(limit, float) else 1.0
    factor = min(_BEYOND_LIMIT * over, _STIFFER_AT_ONCE)
    if left.by == "dial":
        return {"press.travel_mm": round(factor * design.press.travel_mm, 2)}
    kind = design.tips.springs[design.tips.names.index(left.worst_tip)]
    key = "springs.K_l_N_per_m" if kind == "low" else "springs.K_h_N_per_m"
    return {key: _springs(design, factor, factor)[key]}


def _centred(design: Design, factor: float) -> Changes:
    """Return the radii of the design's fruit times a factor [1]; rounder fruit is read too soft."""
    radii = {"fruit.radius_mm": design.fruit.radius_mm, "fruit.radius_across_mm": design.fruit.radius_across_mm}
    return {key: rounded(factor * radius) for key, radius in radii.items() if radius is not None}


def _springs(design: Design, low: float, high: float) -> Changes:
    """Return the given springs of a design times two factors [1], rounded to three digits."""
    return {
        "springs.K_l_N_per_m": rounded((design.springs.K_l_N_per_m or 0.0) * low),
        "springs.K_h_N_per_m": rounded((design.springs.K_h_N_per_m or 0.0) * high),
    }


def _nearest(value: float, step: float) -> float:
    """Return the multiple of a step nearest to a value, at least one step."""
    return round(max(1.0, round(value / step)) * step, 6)
