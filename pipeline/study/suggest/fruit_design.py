"""A sensor for one's own fruit: the preset mango's, as much smaller or softer as the fruit is, stepped until it passes.

Contact has no length and no modulus of its own: a sensor whose lengths go with the fruit's radius, and whose springs go
with radius times modulus, reads as well. What does not scale is left to the steps: rounded sizes, the bruise limit, how
far off centre a hand is, what can be printed.
"""

import math

from cad.design.parameters import Design
from cad.quantity import InputError
from pipeline import run
from pipeline.evaluate import check_targets
from pipeline.options import RunOptions
from pipeline.result import Evaluation
from pipeline.springs.fitted_springs import ideal_springs
from pipeline.springs.sizing import spring_sizing
from pipeline.storage.stopwatch import Progress, silent
from pipeline.study.scenes import scene_compliance, unit_scene
from pipeline.study.suggest.changes import Changes, Value, changed, in_words, value_of
from pipeline.study.suggest.fruit_range import Ends, FruitRange, bruise_limit, with_digits
from pipeline.study.suggest.suggestion import ROUGH, Suggestion
from pipeline.verdicts.hints import least_travel
from solve.fruit.compliance import FruitCompliance

MOST_TRIALS = 30
MOST_RUNS = 4
_LEAST_SPACING_MM = 4.0
_BEYOND_SIDE_MM = 0.5  # between two neighbouring tips, as in the preset
_HALF_MM = 0.5
_DOME_STEP_MM = 0.1
_SPACING_STEP_MM = 0.05
_TRAVEL_STEP_MM = 0.01
_SOFTER = 0.9  # factor of both springs that presses less hard
_BY_BIAS = 0.04  # of the radii, by which the fruit of the design is rounder or flatter
_STIFFER = 1.12  # factor of the high spring that tells firm fruit better


def scaled(fruit: FruitRange, preset: Design) -> Changes:
    """Return the changes of the preset that fit it to a fruit, in sizes that a maker can measure."""
    tips = preset.tips
    moduli = fruit.moduli_MPa
    # As large as the fruit is, but no smaller than plates and leaves can be printed.
    larger = max(_mean_curvature(preset) / fruit.mean_curvature, _LEAST_SPACING_MM / tips.spacing_mm)
    of_preset = math.sqrt(preset.fruit.E_MPa[0] * preset.fruit.E_max_MPa)
    firmer = math.sqrt(fruit.E_min_MPa * fruit.E_max_MPa) / of_preset
    spacing = _nearest(tips.spacing_mm * larger, _SPACING_STEP_MM)
    return {
        "fruit.thickness_mm": _nearest(preset.fruit.depth_mm * larger, _HALF_MM),
        **_shape(fruit, preset),
        "fruit.length_mm": _nearest(preset.fruit.length_mm * larger, _HALF_MM),
        "fruit.width_mm": _nearest(preset.fruit.width_mm * larger, _HALF_MM),
        "fruit.E_max_MPa": fruit.E_max_MPa,
        "fruit.E_MPa": moduli,
        "fruit.bruise_limit_MPa": tuple(bruise_limit(E) for E in moduli),
        "tips.spacing_mm": spacing,
        "tips.side_mm": round(spacing - _BEYOND_SIDE_MM, 2),
        "tips.dome_radius_mm": _nearest((tips.dome_radius_mm or 0.0) * larger, _DOME_STEP_MM),
        "press.travel_mm": max(least_travel(preset), _nearest(preset.press.travel_mm * larger, _TRAVEL_STEP_MM)),
        **_springs(preset, larger * firmer, larger * firmer),
    }


def _shape(fruit: FruitRange, preset: Design) -> Changes:
    """Return the changes of the shape of the fruit, and of which shapes occur: a ball, or principal radii.

    The fruit of the design lies within the ranges where that of the preset lies within its own.
    """
    asked = preset.reading
    if isinstance(fruit.radius_mm, float) or fruit.radius_across_mm is None or asked is None:
        ball = {"fruit.shape": "sphere", "fruit.radius_mm": fruit.radius_mm, "fruit.radius_across_mm": None}
        return {**ball, **dict.fromkeys(("reading.radius_mm", "reading.radius_across_mm", "reading.thickness_mm"))}
    own = preset.fruit
    changes: dict[str, Value] = {
        "fruit.shape": "ellipsoid",
        "fruit.radius_mm": _within(fruit.radius_mm, own.radii_mm[0], asked.radius_mm),
        "fruit.radius_across_mm": _within(fruit.radius_across_mm, own.radii_mm[1], asked.radius_across_mm),
        "reading.radius_mm": fruit.radius_mm,
        "reading.radius_across_mm": fruit.radius_across_mm,
        "reading.thickness_mm": fruit.thickness_mm,
    }
    if fruit.thickness_mm is not None:
        changes["fruit.thickness_mm"] = _within(fruit.thickness_mm, own.depth_mm, asked.thickness_mm)
    return changes


def _within(ends: Ends, of_preset: float, ends_of_preset: Ends | None) -> float:
    """Return the length that lies within its ends as that of the preset does, to three digits [mm]."""
    fraction = 0.5
    if ends_of_preset is not None:
        least, most = ends_of_preset
        fraction = math.log(of_preset / least) / math.log(most / least)
    return with_digits(ends[0] * (ends[1] / ends[0]) ** fraction, 3)


def _mean_curvature(design: Design) -> float:
    """Return the mean curvature in the middle of all radii that occur [1/mm]."""
    radii: tuple[float, ...] = design.fruit.radii_mm
    asked = design.reading
    if asked is not None and asked.radius_mm is not None and asked.radius_across_mm is not None:
        radii = (*asked.radius_mm, *asked.radius_across_mm)
    return math.fsum(1.0 / radius for radius in radii) / len(radii)


def fruit_suggestion(
    fruit: FruitRange, preset: Design, fixed: frozenset[str] = frozenset(), progress: Progress = silent
) -> Suggestion:
    """Return the preset changed for a fruit so that a run shows it to pass, without changing the keys that are `fixed`.

    Raises InputError where fruit and preset make no design, and as `run`.
    """
    changes: Changes = {
        key: value
        for key, value in scaled(fruit, preset).items()
        if key not in fixed and value != value_of(preset, key)
    }
    design = changed(preset, changes)
    progress("starts from the preset in the size of the fruit")
    contact = scene_compliance(unit_scene(design), ROUGH, "split")  # of the first dome: a run knows that of the last
    runs = 0
    seen: set[Design] = set()
    result: Evaluation | None = None
    while len(seen) < MOST_TRIALS and runs < MOST_RUNS and design not in seen:
        seen.add(design)
        result = _with_ideal_springs(design, contact)
        if result is not None and all(verdict.passed is not False for verdict in result.verdicts):
            progress("runs the design that passes with ideal springs")
            runs += 1
            result = run(design, RunOptions())
            if result.passed:
                return Suggestion(design=preset, changes=changes, verdicts=result.verdicts, tried=len(seen), runs=runs)
        step = _step(design, result)
        if not step or not fixed.isdisjoint(step):
            break
        progress(f"tries {in_words(step)}")
        changes = {**changes, **step}
        design = changed(preset, changes)
    verdicts = () if result is None else result.verdicts
    reason = f"none found: of {len(seen)} designs around the preset none passes; the last is that of the verdicts below"
    return Suggestion(design=preset, changes=None, verdicts=verdicts, reason=reason, tried=len(seen), runs=runs)


def _with_ideal_springs(design: Design, contact: FruitCompliance) -> Evaluation | None:
    """Return the verdicts with springs just as stiff as given; None where a level press runs off the face of a dome."""
    sizing = spring_sizing(design, contact, RunOptions())
    try:
        return check_targets(design, contact=contact, sizing=sizing, springs=ideal_springs(design, sizing))
    except InputError as error:
        if error.field != "tips.side_mm":
            raise
        return None


def _step(design: Design, result: Evaluation | None) -> Changes:
    """Return the change that brings a design nearer to passing, in steps that a maker can measure; none for no rule."""
    readings = None if result is None else result.readings
    failed = set() if result is None else {verdict.name for verdict in result.verdicts if verdict.passed is not True}
    off_the_face = readings is not None and readings.face_mm > design.tips.side_mm
    if result is None or off_the_face or "geometry.tip_face" in failed:
        return {"tips.dome_radius_mm": round((design.tips.dome_radius_mm or 0.0) - _HALF_MM, 1)}
    if "bruise" in failed:
        return _springs(design, _SOFTER, _SOFTER)
    if "reading.touch" in failed or (readings is not None and readings.refused is not None):
        return {"press.travel_mm": round(design.press.travel_mm + _TRAVEL_STEP_MM, 2)}
    if "reading.bias" in failed and readings is not None and readings.moduli:
        return _centred(design, readings.worst_bias.bias.value)
    if "reading.uncertainty" in failed:
        return {"springs.K_h_N_per_m": _springs(design, 1.0, _STIFFER)["springs.K_h_N_per_m"]}
    return {}


def _centred(design: Design, bias: float) -> Changes:
    """Return a fruit of the design that is nearer to that of the largest bias [1]: rounder fruit is read too soft."""
    factor = 1.0 - _BY_BIAS if bias < 0.0 else 1.0 + _BY_BIAS
    radii = {"fruit.radius_mm": design.fruit.radius_mm, "fruit.radius_across_mm": design.fruit.radius_across_mm}
    return {key: with_digits(factor * radius, 3) for key, radius in radii.items() if radius is not None}


def _springs(design: Design, low: float, high: float) -> Changes:
    """Return the given springs of a design times two factors [1], with three digits."""
    return {
        "springs.K_l_N_per_m": with_digits((design.springs.K_l_N_per_m or 0.0) * low, 3),
        "springs.K_h_N_per_m": with_digits((design.springs.K_h_N_per_m or 0.0) * high, 3),
    }


def _nearest(value: float, step: float) -> float:
    """Return the multiple of a step that is nearest to a value, at least one step [unit of both]."""
    return round(max(1.0, round(value / step)) * step, 6)
