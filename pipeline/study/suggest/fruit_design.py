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
from pipeline.study.suggest.changes import Changes, changed, in_words, value_of
from pipeline.study.suggest.fruit_range import FruitRange, bruise_limit, with_digits
from pipeline.study.suggest.suggestion import ROUGH, Suggestion
from pipeline.verdicts.hints import least_travel
from solve.fruit.compliance import FruitCompliance

MOST_TRIALS = 30
MOST_RUNS = 4
_BEYOND_SIDE_MM = 0.4  # between two neighbouring tips, as in the preset
_HALF_MM = 0.5
_TRAVEL_STEP_MM = 0.05
_OFF_CENTRE_STEP_MM = 0.1
_SOFTER = 0.9  # factor of both springs that presses less hard
_STIFFER = 1.12  # factor of the high spring that tells firm fruit better


def scaled(fruit: FruitRange, preset: Design) -> Changes:
    """Return the changes of the preset that fit it to a fruit, in sizes that a maker can measure."""
    tips = preset.tips
    moduli = fruit.moduli_MPa
    larger = fruit.radius_mm / (preset.fruit.radius_mm or fruit.radius_mm)
    of_preset = math.sqrt(preset.fruit.E_MPa[0] * preset.fruit.E_max_MPa)
    firmer = math.sqrt(fruit.E_min_MPa * fruit.E_max_MPa) / of_preset
    off_centre = 0.0 if preset.reading is None else preset.reading.off_centre_mm
    spacing = max(4.0, _nearest(tips.spacing_mm * larger, _HALF_MM))
    return {
        "fruit.radius_mm": fruit.radius_mm,
        "fruit.length_mm": _nearest(preset.fruit.length_mm * larger, _HALF_MM),
        "fruit.width_mm": _nearest(preset.fruit.width_mm * larger, _HALF_MM),
        "fruit.thickness_mm": _nearest(preset.fruit.depth_mm * larger, _HALF_MM),
        "fruit.E_max_MPa": fruit.E_max_MPa,
        "fruit.E_MPa": moduli,
        "fruit.bruise_limit_MPa": tuple(bruise_limit(E) for E in moduli),
        "tips.spacing_mm": spacing,
        "tips.side_mm": round(spacing - _BEYOND_SIDE_MM, 1),
        "tips.dome_radius_mm": _nearest((tips.dome_radius_mm or 0.0) * larger, _HALF_MM),
        "press.travel_mm": max(least_travel(preset), _nearest(preset.press.travel_mm * larger, _TRAVEL_STEP_MM)),
        "reading.off_centre_mm": _nearest(min(1.0, larger) * off_centre, _OFF_CENTRE_STEP_MM),
        **_springs(preset, larger * firmer, larger * firmer),
    }


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
        return {"tips.dome_radius_mm": (design.tips.dome_radius_mm or 0.0) - _HALF_MM}
    if "bruise" in failed:
        return _springs(design, _SOFTER, _SOFTER)
    if "reading.lift" in failed or (readings is not None and readings.refused is not None):
        return {"press.travel_mm": round(design.press.travel_mm + _TRAVEL_STEP_MM, 2)}
    if "reading.uncertainty" in failed:
        return {"springs.K_h_N_per_m": _springs(design, 1.0, _STIFFER)["springs.K_h_N_per_m"]}
    return {}


def _springs(design: Design, low: float, high: float) -> Changes:
    """Return the given springs of a design times two factors [1], with two digits."""
    return {
        "springs.K_l_N_per_m": with_digits((design.springs.K_l_N_per_m or 0.0) * low, 2),
        "springs.K_h_N_per_m": with_digits((design.springs.K_h_N_per_m or 0.0) * high, 2),
    }


def _nearest(value: float, step: float) -> float:
    """Return the multiple of a step that is nearest to a value, at least one step [unit of both]."""
    return round(max(1.0, round(value / step)) * step, 6)
