"""What would make a failed scene pass: a few changes of press and tips, each solved, with springs sized anew."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cad.design.parameters import Design
from cad.quantity import InputError
from cad.verdict import Verdict
from pipeline.options import RunOptions
from pipeline.stages.contact import contact_compliance
from pipeline.stages.response import TRAVELS, ScenePress, mean_tip_pressure, scene_of
from pipeline.stages.sizing import spring_sizing
from pipeline.verdicts.rules import SPREAD_TOLERANCE, displacement_verdict
from solve.contact.linear_response import SensorResponse, spring_compliance, travels
from solve.contact.response import scene_response
from solve.linear import SolveError

OF_THE_SCENE = ("P_max", "NL", "P_displacement_independent", "P_monotonic", "bruise")
_ROUGH = 0.02  # relative error of the compliance that is enough to try a change
_SLACK = 0.98  # of a bruise limit, for a travel that is to stay under it


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A change of the design in words, and by how much P then varies over the travel [1]; None where a tip is off."""

    words: str
    spread: float | None
    passes: bool


def remedy(design: Design, verdicts: Sequence[Verdict], press: ScenePress) -> str | None:
    """Return what would make the scene pass, in a sentence, or that nothing tried does; None where it passes."""
    failed = [verdict for verdict in verdicts if verdict.passed is False and verdict.name in OF_THE_SCENE]
    if not failed:
        return None
    if any(press.ahead):
        apart = max(press.ahead) - min(press.ahead)
        return f"zero the tips in this attitude: their own weight sets them {apart:.2g} mm off level"
    if design.press.strain == "large":
        return (
            "springs are sized for linear flesh: press less deep or take wider tips, so that large strain moves P less"
        )
    if press.level:
        return _shorter_travel(design, press) if [one.name for one in failed] == ["bruise"] else None
    trials = [trial for words, change in _changes(design) if (trial := _tried(words, change)) is not None]
    passing = [trial.words for trial in trials if trial.passes]
    return f"would pass, with springs sized anew: {' or '.join(passing)}" if passing else _nearest(trials)


def _nearest(trials: Sequence[Trial]) -> str:
    """Return that no trial passes, and which comes nearest."""
    tried = ", ".join(trial.words for trial in trials) or "none could be solved"
    known = [(trial.spread, trial.words) for trial in trials if trial.spread is not None]
    if not known:
        return f"no change of travel, side or spacing passes; tried: {tried}"
    spread, words = min(known)
    return (
        f"no change of travel, side or spacing passes for a pair of flat tips in this scene; nearest: {words}, where P "
        f"still varies by {100.0 * spread:.2g} % over the travel (at most {100.0 * SPREAD_TOLERANCE:g} %); "
        f"tried: {tried}"
    )


def _shorter_travel(design: Design, press: ScenePress) -> str | None:
    """Return the travel at which the mean pressure stays under the bruise limit; forces grow with the travel."""
    limits, pressure = design.fruit.bruise_limits_MPa, mean_tip_pressure(design, press)
    if not limits or pressure <= 0.0:
        return None
    travel = _SLACK * design.press.travel_mm * max(limits) / pressure
    return f"would pass: press.travel_mm at most {travel:.3g}"


def _changes(design: Design) -> Iterator[tuple[str, Design]]:
    """Yield changes of a design in words and done; one that is no design is left out."""
    press, tips = design.press, design.tips
    if press.tilt_deg != 0.0 or press.roll_deg != 0.0:
        yield "pressed level", replace(design, press=replace(press, tilt_deg=0.0, roll_deg=0.0))
    for factor in (0.5, 2.0, 4.0):
        yield from _changed(design, "press", "travel_mm", factor * press.travel_mm)
    for factor in (0.5, 0.25):
        yield from _changed(design, "tips", "side_mm", factor * tips.side_mm)
    yield from _changed(design, "tips", "spacing_mm", 2.0 * tips.side_mm)


def _changed(design: Design, table: str, key: str, value: float) -> Iterator[tuple[str, Design]]:
    try:
        record = replace(getattr(design, table), **{key: value})
        yield f"{table}.{key} = {value:.3g}", replace(design, **{table: record})
    except InputError:
        return


def _tried(words: str, design: Design) -> Trial | None:
    """Return how a design fares with ideal springs; None where it cannot be sized or solved."""
    try:
        return _trial(words, design)
    except (InputError, SolveError):
        return None


def _trial(words: str, design: Design) -> Trial:
    table = _response(design)
    spread, last = displacement_verdict(table), table.P[:, -1]
    limits = design.fruit.bruise_limits_MPa
    bruised = bool(limits) and table.F[-1, -1].max() > max(limits) * design.tips.face_mm2
    meant = np.all(np.diff(last) > 0.0) and abs(last[-1] / design.nominal_targets.P_max - 1.0) <= _ROUGH
    return Trial(words=words, spread=spread.value, passes=bool(spread.passed and meant and not bruised))


def _response(design: Design) -> SensorResponse:
    """Return the response of ideal springs sized for a design, at its least and its largest modulus.

    By the split alone: direct finite elements of a fruit are too dear for a trial.
    """
    contact = contact_compliance(design.fruit.equivalent_block, design.tips, "split", _ROUGH)
    springs = spring_sizing(design, contact, RunOptions()).springs
    moduli = sorted({min(design.fruit.E_MPa), design.fruit.E_max_MPa})
    steps = travels(design.press.travel_mm, TRAVELS)
    return scene_response(scene_of(design), contact, spring_compliance(*springs.stiffnesses), moduli, steps)
