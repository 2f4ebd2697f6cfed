"""A sensor for a given fruit: the preset for the most similar fruit, scaled to the fruit's size and firmness.

The contact problem has no intrinsic length or modulus. The lengths of a scaled sensor are proportional to the radius of
the fruit, and its spring stiffnesses to radius times modulus. A scaled sensor therefore reads as accurately as its
preset. Some quantities do not scale: rounded dimensions, the bruise limit, the accuracy with which a hand places the
sensor, and the limits of printing. Further steps of the search correct for these.
"""

import math
from collections.abc import Sequence

from pipeline.find.candidate import Candidate
from pipeline.find.changes import Changes, change_design, in_words, value_of
from pipeline.find.fruit_range import Ends, FruitRange, bruise_limit
from pipeline.find.proved_candidate import prove_first
from pipeline.find.suggestion import Suggestion
from pipeline.options import RunOptions, load_design
from pipeline.reading.reading_records import CalibrationErrors
from pipeline.result import SensorResult
from pipeline.sensor import Sensor
from pipeline.storage.stopwatch import Progress, ignore_progress
from pipeline.verdicts.hints import least_travel
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.quantity import InputError
from sensor.verdict import row_of
from sensor.words import rounded

PRESETS = ("apple", "avocado", "kiwi", "mango", "orange", "peach", "pear", "plum", "tomato")
"""The presets for single fruits. A whole run of each of them passes."""

MAX_TRIALS = 30  # maximum number of designs that are tried with sized springs
MAX_RUNS = 4  # maximum number of whole runs
# relative tolerance of the springs [1], at which the contact is accurate enough for the error bars of readings
TOLERANCE = 0.01
_MIN_SPACING_MM = 4.5  # with a smaller spacing the leaves are shallower, and a tilted fruit pushes them sideways
_TIP_GAP_MM = 0.5  # gap between neighbouring tips [mm], as in the presets
# maximum depth of the corners of the piece of fruit below its apex, divided by the flesh thickness
_CORNER_FALL = 0.6
_CORNER_FALL_THINNEST = 0.9  # the same ratio for the roundest fruit with the thinnest flesh
_CAP_FALL = 0.6  # maximum depth of a corner below the apex, divided by the radius of the fruit
_SIZE_STEP_MM = 0.5  # step to which dimensions of the fruit are rounded [mm]
_DOME_STEP_MM = 0.1  # step to which the radius of a dome is rounded [mm]
_DOME_REDUCTION_MM = 0.5  # reduction of the radius of a dome in one step [mm], if its contact is too wide
_SPACING_STEP_MM = 0.05  # step to which the spacing of the tips is rounded [mm]
_TRAVEL_STEP_MM = 0.01  # step to which the travel is rounded [mm], and by which it is increased
_TRAVEL_REDUCTION_MM = 0.02  # reduction of the travel in one step [mm], which reduces biases of both signs
_BRUISE_FACTOR = 0.9  # factor on the stiffness of both springs if the fruit bruises
_RADIUS_FACTOR = 1.04  # initial factor on the radii of the design's fruit if the bias is too large
# margin on the change that removes the largest part of the calibration error, because the other parts remain
_CALIBRATION_MARGIN = 1.05
_MAX_CALIBRATION_FACTOR = 1.5  # maximum factor of a change that improves the calibration; further steps may follow
_UNCERTAINTY_FACTOR = 1.12  # factor on the stiffness of the high spring, which improves readings of firm fruit


def most_similar_preset(fruit: FruitRange) -> str:
    """Return the name of the preset whose fruit is most similar to a given fruit."""
    return min(PRESETS, key=lambda name: _dissimilarity(fruit, fruit_range_of_design(load_design(name))))


def fruit_range_of_design(design: Design) -> FruitRange:
    """Return the range of fruits that a design reads.

    If the design gives no range of a dimension, both ends are the dimension of its single fruit.
    """
    fruit = design.fruit
    requirements = design.reading or ReadingRequirements()
    radius, radius_across = fruit.radii_mm
    return FruitRange(
        name=fruit.name,
        radius_mm=requirements.radius_mm or (radius, radius),
        radius_across_mm=requirements.radius_across_mm or (radius_across, radius_across),
        thickness_mm=requirements.thickness_mm or (fruit.depth_mm, fruit.depth_mm),
        E_min_MPa=min(fruit.E_MPa),
        E_max_MPa=fruit.E_max_MPa,
    )


def _dissimilarity(fruit: FruitRange, other: FruitRange) -> float:
    """Return the dissimilarity of two fruits [1]: the sum of the squared logarithms of ratios between them.

    The ratios are between the smallest moduli, the largest moduli and the geometric means of the radii. If both
    thicknesses of the flesh are known, their geometric means are compared too. The two radii of each fruit are sorted,
    because its orientation under the sensor does not matter.
    """
    ratios = [fruit.E_min_MPa / other.E_min_MPa, fruit.E_max_MPa / other.E_max_MPa]
    radii = sorted(map(_geometric_mean, fruit.radii_mm))
    other_radii = sorted(map(_geometric_mean, other.radii_mm))
    for radius, other_radius in zip(radii, other_radii, strict=True):
        ratios.append(radius / other_radius)
    if fruit.thickness_mm is not None and other.thickness_mm is not None:
        ratios.append(_geometric_mean(fruit.thickness_mm) / _geometric_mean(other.thickness_mm))
    return math.fsum(math.log(ratio) ** 2 for ratio in ratios)


def _geometric_mean(ends: Ends) -> float:
    """Return the geometric mean of the ends of a range, in their unit."""
    return math.sqrt(ends[0] * ends[1])


def scaled_changes(fruit: FruitRange, preset: Design) -> Changes:
    """Return the changes that scale a preset to a fruit, rounded to dimensions that a maker can measure.

    Lengths are multiplied by the ratio of the new fruit's radii to the preset fruit's radii. A spring stiffness is a
    length times a modulus, so it is multiplied by this ratio and by the ratio of the moduli.
    """
    tips = preset.tips
    preset_fruit = preset.fruit
    preset_range = fruit_range_of_design(preset)
    moduli = fruit.moduli_MPa
    # The sensor is scaled with the fruit, but not to less than the minimum spacing of the tips. A curvature is the
    # reciprocal of a radius, so the ratio of the radii is the reciprocal of the ratio of the curvatures.
    min_ratio = min(1.0, _MIN_SPACING_MM / tips.spacing_mm)
    length_ratio = max(preset_range.mean_curvature / fruit.mean_curvature, min_ratio)
    modulus_ratio = _middle_modulus(fruit) / _middle_modulus(preset_range)
    stiffness_factor = length_ratio * modulus_ratio
    spacing = _round_to(tips.spacing_mm * length_ratio, _SPACING_STEP_MM)
    radius, radius_across, depth = _assumed_fruit(fruit, preset, length_ratio)
    # Contact is solved on a piece of the fruit. Its corners must lie on the design's fruit and on every fruit of the
    # range.
    max_side = min(_largest_piece(radius, radius_across, _CORNER_FALL * depth), _largest_piece_of_range(fruit, depth))
    return {
        "fruit.thickness_mm": depth,
        "fruit.radius_mm": radius,
        "fruit.radius_across_mm": radius_across,
        "reading.radius_mm": fruit.radii_mm[0],
        "reading.radius_across_mm": fruit.radii_mm[1],
        "reading.thickness_mm": fruit.thickness_mm,
        "fruit.length_mm": _round_to(min(preset_fruit.length_mm * length_ratio, max_side), _SIZE_STEP_MM),
        "fruit.width_mm": _round_to(min(preset_fruit.width_mm * length_ratio, max_side), _SIZE_STEP_MM),
        "fruit.E_max_MPa": fruit.E_max_MPa,
        "fruit.E_MPa": moduli,
        "fruit.name": fruit.name,
        "fruit.bruise_limit_MPa": tuple(bruise_limit(E, fruit.name) for E in moduli),
        "tips.spacing_mm": spacing,
        "tips.side_mm": round(spacing - _TIP_GAP_MM, 2),
        "tips.dome_radius_mm": _round_to((tips.dome_radius_mm or 0.0) * length_ratio, _DOME_STEP_MM),
        "press.travel_mm": max(least_travel(preset), _round_to(preset.press.travel_mm * length_ratio, _TRAVEL_STEP_MM)),
        **_scale_springs(preset, stiffness_factor, stiffness_factor),
    }


def _assumed_fruit(fruit: FruitRange, preset: Design, length_ratio: float) -> tuple[float, float, float]:
    """Return the two principal radii and the flesh thickness [mm] of the single fruit that a new design assumes.

    The closed-form equations of a design apply to a single fruit. Each of its dimensions has the same relative position
    in the range of the new fruit as the preset's dimension has in the preset's range. If a range of thicknesses is
    unknown, the thickness of the preset is multiplied by `length_ratio` [1].
    """
    preset_fruit = preset.fruit
    preset_range = fruit_range_of_design(preset)
    along, across = fruit.radii_mm  # ranges of the two principal radii
    preset_along, preset_across = preset_range.radii_mm
    radius = _same_position_in_range(along, preset_fruit.radii_mm[0], preset_along)
    radius_across = _same_position_in_range(across, preset_fruit.radii_mm[1], preset_across)
    depth = _round_to(preset_fruit.depth_mm * length_ratio, _SIZE_STEP_MM)
    if fruit.thickness_mm is not None and preset_range.thickness_mm is not None:
        depth = _same_position_in_range(fruit.thickness_mm, preset_fruit.depth_mm, preset_range.thickness_mm)
    return radius, radius_across, depth


def _middle_modulus(fruit: FruitRange) -> float:
    """Return the geometric mean of the smallest and the largest modulus [MPa]."""
    return math.sqrt(fruit.E_min_MPa * fruit.E_max_MPa)


def _largest_piece(radius: float, radius_across: float, fall: float) -> float:
    """Return the side [mm] of the largest square piece of an ellipsoid with corners at most `fall` [mm] below the apex.

    The principal radii R = `radius` and R_across = `radius_across` [mm] are along the sides. A corner at (h, h) obeys

        (1 - fall / R)^2 = 1 - h^2 / R^2 - h^2 / (R R_across),

    as in `Fruit.fall_mm`. The equation is solved for the side 2 h. The fall is limited to 0.6 R, because lower corners
    are not on the cap of the fruit.
    """
    height_squared = (1.0 - min(fall / radius, _CAP_FALL)) ** 2  # left side of the equation
    return 2.0 * radius * math.sqrt((1.0 - height_squared) / (1.0 + radius / radius_across))


def _largest_piece_of_range(fruit: FruitRange, depth: float) -> float:
    """Return the side [mm] of the largest square piece with corners on every fruit of the range, at any azimuth.

    The worst case is the roundest fruit with the thinnest flesh. If no range of thickness is known, the flesh has the
    thickness `depth` [mm]. The most curved section may lie along a diagonal of the piece. A corner is then as far
    below the apex as on a ball of the smallest radius.
    """
    min_radius = min(radius for ends in fruit.radii_mm for radius in ends)
    min_thickness = depth if fruit.thickness_mm is None else fruit.thickness_mm[0]
    return _largest_piece(min_radius, min_radius, _CORNER_FALL_THINNEST * min_thickness)


def _same_position_in_range(ends: Ends, preset_length: float, preset_ends: Ends) -> float:
    """Return the length [mm] that has the same position in the range `ends` as a preset's length in the preset's range.

    The position is a fraction on a logarithmic scale, from 0 at the lower end to 1 at the upper end. If the preset's
    length lies outside its range by some factor, the result lies outside `ends` by the same factor. The result is
    rounded to three digits.
    """
    low, high = preset_ends
    if preset_length <= low:
        return rounded(ends[0] * preset_length / low)
    if preset_length >= high:
        return rounded(ends[1] * preset_length / high)
    fraction = math.log(preset_length / low) / math.log(high / low)
    return rounded(ends[0] * (ends[1] / ends[0]) ** fraction)


def fruit_suggestion(
    fruit: FruitRange, preset: Design, fixed: frozenset[str] = frozenset(), progress: Progress = ignore_progress
) -> Suggestion:
    """Search for a design for a fruit that passes a whole run, starting from the scaled preset.

    The keys in `fixed` are not changed. A design is first tried with sized springs, which cost less than a run. If a
    verdict fails, `_next_step` changes the design. If all verdicts pass, a whole run must confirm them. The search ends
    if a run passes, if no rule suggests a step that leaves the `fixed` keys unchanged, if a design was tried before, or
    if a limit of trials or runs is reached. If no design passes a run, the suggestion has no changes, and it has the
    verdicts of the design nearest to passing.

    Raises InputError if a changed design is invalid, and MeshError or SolveError if a trial cannot be solved.
    """
    changes = _free_changes(scaled_changes(fruit, preset), preset, fixed)
    design = change_design(preset, changes)
    runs = 0
    tried_designs: set[Design] = set()
    candidates: list[Candidate] = []
    centring = _Centring()
    # The search also ends at a design that was tried before, so that it does not go round in a circle.
    while len(tried_designs) < MAX_TRIALS and runs < MAX_RUNS and design not in tried_designs:
        tried_designs.add(design)
        tried = len(tried_designs)
        result: Sensor | SensorResult | None = _solve_sized(design)  # None if the design cannot be solved
        candidate = _make_candidate(changes, result)
        # The scaled preset is run even if some verdicts are undecided, because the preset passed its own run. Springs
        # solved by finite elements may decide these verdicts.
        is_scaled_preset = not candidates
        if candidate.passes or (is_scaled_preset and not _has_failed(candidate)):
            progress("running the design that passes with ideal springs")
            runs += 1
            result = _run_candidate(preset, candidate)
            candidate = _make_candidate(changes, result)
            if result is not None and result.passed:
                return Suggestion(design=preset, changes=changes, verdicts=result.verdicts, tried=tried, runs=runs)
        candidates.append(candidate)
        step = _next_step(design, result, centring)
        if not step or not fixed.isdisjoint(step):
            break
        progress(f"trying design {tried + 1} of at most {MAX_TRIALS}: {in_words(step)}")
        changes = {**changes, **step}
        design = change_design(preset, changes)
    return _none_found(preset, candidates, runs)


def _none_found(preset: Design, candidates: Sequence[Candidate], runs: int) -> Suggestion:
    """Return the suggestion without changes, with the verdicts of the candidate nearest to passing.

    `candidates` are all designs that were tried, and `runs` is the number of whole runs.
    """
    nearest = min(candidates, key=lambda candidate: candidate.shortfall)
    tried = len(candidates)
    reason = f"none found: none of {tried} designs around the preset passes; the nearest one has the verdicts below"
    verdicts = nearest.verdicts or ()
    return Suggestion(design=preset, changes=None, verdicts=verdicts, reason=reason, tried=tried, runs=runs)


def _free_changes(changes: Changes, preset: Design, fixed: frozenset[str]) -> Changes:
    """Return the changes of keys that are not in `fixed` and whose value differs from the value in the preset."""
    return {key: value for key, value in changes.items() if key not in fixed and value != value_of(preset, key)}


class _Centring:
    """The factor [1] by which the radii of the design's fruit are changed in each step, until the largest bias passes.

    The largest bias has one sign if the assumed fruit is too flat, and the other sign if it is too round. When the sign
    changes, the last step went past the best radius. The logarithm of the factor is then halved.
    """

    def __init__(self) -> None:
        """Start with the largest factor, before any bias is recorded."""
        self.factor = _RADIUS_FACTOR
        self._last_bias = 0.0

    def record_bias(self, bias: float) -> bool:
        """Record the largest bias [1] of the next design, and return whether its sign changed, which halves the step.

        A bias of 0 means that the bias of the design passes. It does not change the recorded sign.
        """
        sign_changed = bias * self._last_bias < 0.0
        if sign_changed:
            self.factor = math.sqrt(self.factor)  # halves its logarithm
        self._last_bias = bias or self._last_bias
        return sign_changed


def _next_step(design: Design, result: Sensor | SensorResult | None, centring: _Centring) -> Changes:
    """Return the next change of a design: the change for its failed verdicts, and possibly a shorter travel.

    The result is empty if no rule applies. `result` holds the verdicts on `design`; it is None if the design cannot be
    solved. If the largest bias changed its sign since the last step, the travel becomes shorter, because that reduces
    biases of both signs. The bias is recorded in `centring`, which provides the factor for the radii.
    """
    failed = _failed_verdicts(result)
    sign_changed = centring.record_bias(_failing_bias(result, failed))
    step = _change_for_failed_verdicts(design, result, failed, centring.factor)
    if not sign_changed:
        return step
    shorter = round(design.press.travel_mm - _TRAVEL_REDUCTION_MM, 2)
    return {**step, "press.travel_mm": max(least_travel(design), shorter)}


def _make_candidate(changes: Changes, result: Sensor | SensorResult | None) -> Candidate:
    """Return the candidate with the given changes and the verdicts of its `result`; without a result, it has none."""
    return Candidate(changes=changes, verdicts=None if result is None else result.verdicts)


def _run_candidate(preset: Design, candidate: Candidate) -> SensorResult | None:
    """Run a candidate and return its result, or None if its design is invalid or cannot be solved."""
    proof = prove_first([candidate], lambda one: change_design(preset, one.changes), RunOptions(), max_runs=1)
    return None if proof is None else proof.result


def _solve_sized(design: Design) -> Sensor | None:
    """Return the solved sensor of a design with sized springs; None if a level press extends beyond a dome's face.

    Raises InputError for any other invalid design, and MeshError or SolveError if the design cannot be solved.
    """
    sensor = Sensor(design=design, options=RunOptions(tolerance=TOLERANCE), springs_as="sized")
    try:
        sensor.solve("verdicts")
    except InputError as error:
        if error.field != "tips.side_mm":  # the field of the error about the face of a dome
            raise
        return None
    return sensor


def _has_failed(candidate: Candidate) -> bool:
    """Return whether a verdict on the candidate fails, or the candidate has no verdicts.

    An undecided verdict has not failed.
    """
    return candidate.verdicts is None or any(verdict.passed is False for verdict in candidate.verdicts)


def _failed_verdicts(result: Sensor | SensorResult | None) -> set[str]:
    """Return the names of verdicts that did not pass or, if all passed, of verdicts that lack the required margin."""
    candidate = _make_candidate({}, result)
    failed_or_undecided = {verdict.name for verdict in candidate.verdicts or () if verdict.passed is not True}
    return failed_or_undecided or {verdict.name for verdict in candidate.failed}


def _failing_bias(result: Sensor | SensorResult | None, failed: set[str]) -> float:
    """Return the largest bias [1] if its verdict failed, and otherwise 0; it is positive if fruit is read too firm."""
    readings = None if result is None else result.readings
    if readings is None or not readings.moduli or "reading.bias" not in failed:
        return 0.0
    return readings.worst_bias.bias.value


def _change_for_failed_verdicts(
    design: Design, result: Sensor | SensorResult | None, failed: set[str], radius_factor: float
) -> Changes:
    """Return the change that brings a design nearer to passing, from the first rule that applies; empty if none does.

    `result` holds the readings of `design`; it is None if the design cannot be solved. `failed` holds the names of
    failed verdicts. `radius_factor` [1] is greater than 1. The radii of the design's fruit are multiplied by this
    factor to make the fruit flatter, or divided by it to make the fruit rounder.
    """
    readings = None if result is None else result.readings
    is_beyond_face = readings is not None and readings.face_mm > design.tips.side_mm
    if result is None or is_beyond_face or "geometry.tip_face" in failed:  # a smaller dome has a narrower contact
        # A radius of 0 or less makes the design invalid, which raises InputError when the change is made.
        smaller_radius = (design.tips.dome_radius_mm or 0.0) - _DOME_REDUCTION_MM
        return {"tips.dome_radius_mm": round(smaller_radius, 1)}
    if "bruise" in failed:  # softer springs press with smaller forces
        return _scale_springs(design, _BRUISE_FACTOR, _BRUISE_FACTOR)
    if "reading.touch" in failed or (readings is not None and readings.refused is not None):
        # In a longer press, the last tip touches after a smaller fraction of the travel.
        return {"press.travel_mm": round(design.press.travel_mm + _TRAVEL_STEP_MM, 2)}
    if "reading.calibration" in failed and readings is not None and readings.calibration is not None:
        return _improve_calibration(design, readings.calibration)
    bias = _failing_bias(result, failed)
    if bias:
        # Fruit is read too firm if it is flatter than assumed, so the assumed fruit becomes flatter. Fruit is read too
        # soft if it is rounder than assumed.
        change_factor = radius_factor if bias > 0.0 else 1.0 / radius_factor
        return _scale_radii(design, change_factor)
    if "reading.uncertainty" in failed:
        # A stiffer high spring improves readings of firm fruit. The low spring keeps its stiffness, so only one key is
        # taken.
        key = "springs.K_h_N_per_m"
        return {key: _scale_springs(design, 1.0, _UNCERTAINTY_FACTOR)[key]}
    return {}


def _improve_calibration(design: Design, errors: CalibrationErrors) -> Changes:
    """Return the change that reduces the largest error of a spring's stiffness after calibration.

    If the dial is the largest cause of the error, the travel becomes longer, because the dial then has a smaller
    relative error. Otherwise the spring of the worst tip becomes stiffer, so that its calibration uses larger weights.
    The factor of the change is the ratio of the error to its limit, with a margin.
    """
    limit = row_of("reading.calibration").limit
    excess = errors.largest_stiffness / limit if isinstance(limit, float) else 1.0
    factor = min(_CALIBRATION_MARGIN * excess, _MAX_CALIBRATION_FACTOR)
    if errors.by == "dial":
        return {"press.travel_mm": round(factor * design.press.travel_mm, 2)}
    spring = design.tips.springs[design.tips.names.index(errors.worst_tip)]
    key = "springs.K_l_N_per_m" if spring == "low" else "springs.K_h_N_per_m"
    return {key: _scale_springs(design, factor, factor)[key]}


def _scale_radii(design: Design, factor: float) -> Changes:
    """Return the change that multiplies the radii of the design's fruit by a factor [1].

    These radii are assumed in every reading. A fruit that is rounder than assumed is read too soft.
    """
    radii = {"fruit.radius_mm": design.fruit.radius_mm, "fruit.radius_across_mm": design.fruit.radius_across_mm}
    return {key: rounded(factor * radius) for key, radius in radii.items() if radius is not None}


def _scale_springs(design: Design, low: float, high: float) -> Changes:
    """Return the change that multiplies the stiffnesses of the springs by `low` and `high` [1], rounded to 3 digits."""
    return {
        "springs.K_l_N_per_m": rounded((design.springs.K_l_N_per_m or 0.0) * low),
        "springs.K_h_N_per_m": rounded((design.springs.K_h_N_per_m or 0.0) * high),
    }


def _round_to(value: float, step: float) -> float:
    """Return the multiple of `step` nearest to `value`, but at least one step."""
    return round(max(1.0, round(value / step)) * step, 6)
