"""What each error bar is made of: the discretisation, what the model leaves out, what is not known of the inputs.

A verdict asks whether the design meets its targets in the model, so it uses the discretisation alone, which a finer
mesh decides. No mesh takes away the model's share or the scatter of a process: calibrating the printed unit does.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

from cad.parts.engraving import ENGRAVED_MM
from cad.theory.elastica import large_deflection_stiffening
from cad.theory.soft_tissue import LARGEST_LOSS, flesh_law, large_strain, no_slip
from cad.theory.strain_gauge import GAUGES, sandwich_gain
from cad.theory.two_spring_law import Definition, series_stiffness, stiffness_at_largest_nonlinearity
from pipeline.stages.springs import PrintedSprings
from pipeline.stages.verdict_rules import Judged
from pipeline.stages.verdicts import Case
from solve.contact.response import SceneResponse

Pair = tuple[float, float]
Moved = tuple[float, float, float, float]
"""Relative changes of K_l, of K_h, and of the fruit's stiffness under the low and under the high tip [1]."""

SIGMAS = 2.0  # which accuracy_mm of a process is
BEAM_SLOPES = (3.0, 3.0)  # of ln K over ln t: a beam's, which solids stay under
FOOT_MM, FOOT_HIGH_MM = 0.15, 0.2  # how far the first layer of a print spreads on each side of a leaf, and how high
GLUED = 0.25  # of what gauges stiffen: makers do not give the fill of a grid and the thickness of the glue
GROUND_MM = 0.01  # of ground steel bar, as dealers sell it
# Share of the frame in 1/K times E w / K: FE gave 0.08 and 0.6 % at K 0.753 and 17.3 N/mm, E 2000 MPa, w 6 mm.
FRAME_SHARES = (0.0008 * 12000.0 / 0.753, 0.006 * 12000.0 / 17.3)
ROUNDING = 1.8  # loss of stiffness at first touch over edge radius / side: FE at 0.05 and 0.1
LONGEST_SHARE = 0.5  # of a leaf, to which the elastica is given
FELT = 1e-6  # a smaller move is scaled up to this, its answer down again: round-off would drown it


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One share of an error: what acts, by how much of the number it moves it [%], and why by this much."""

    effect: str
    size_percent: float
    reason: str

    def __post_init__(self) -> None:
        """Refuse an effect without a name, a size or a reason: something would be left out unsaid."""
        if not (math.isfinite(self.size_percent) and self.size_percent != 0.0 and self.effect and self.reason):
            raise ValueError(_nothing(self.effect, self.size_percent, self.reason))


def _nothing(effect: str, size: float, reason: str) -> str:
    wanted = "a name, a finite size other than 0 and a reason"
    return f"effect {effect!r} = {size:g} %, reason {reason!r}: must have {wanted}; compute it"


@dataclass(frozen=True, kw_only=True)
class NumberError:
    """The make-up of the error of one number, every share relative to it [%]."""

    discretisation_percent: float
    model: tuple[Effect, ...]
    inputs: tuple[Effect, ...]

    def __post_init__(self) -> None:
        """Refuse a number without an error bar, or with nothing said of the model or of the inputs."""
        if not (0.0 < self.discretisation_percent < math.inf and self.model and self.inputs):
            msg = (
                f"discretisation = {self.discretisation_percent:g} %, {len(self.model)} effects, {len(self.inputs)} "
                "inputs: must be greater than 0 and at least one of each; complete the make-up"
            )
            raise ValueError(msg)

    @property
    def model_percent(self) -> float:
        """Return the model's share [%]: its effects act together, so their sizes add."""
        return sum(abs(one.size_percent) for one in self.model)

    @property
    def inputs_percent(self) -> float:
        """Return the inputs' share [%], two sigma: they scatter apart, so their squares add."""
        return math.hypot(*(one.size_percent for one in self.inputs))

    def entry(self) -> dict[str, Any]:
        """Return the make-up as plain data."""
        return {**asdict(self), "model_percent": self.model_percent, "inputs_percent": self.inputs_percent}


@dataclass(frozen=True, kw_only=True)
class Makeup:
    """The make-up of the error of each number; `contact` is s11 - s12. Springs that are not made have none."""

    K_l: NumberError | None
    K_h: NumberError | None
    P_max: NumberError
    NL: NumberError
    contact: NumberError


@dataclass(frozen=True)
class _Cause:
    """What moves the springs or the fruit: by `at` at a fruit stiffness [N/mm], by `most` at its largest."""

    effect: str
    reason: str
    most: Moved
    at: Callable[[float], Moved]

    def __post_init__(self) -> None:
        """Refuse a cause that moves nothing, which no number would list."""
        if not any(self.most):
            raise ValueError(_nothing(self.effect, 0.0, self.reason))

    @property
    def of_springs(self) -> bool:
        """Say whether it is the springs that it moves."""
        return any(self.most[:2])


def _constant(effect: str, reason: str, moved: Moved) -> _Cause:
    return _Cause(effect, reason, moved, lambda _: moved)


_Causes = tuple[tuple[_Cause, ...], tuple[_Cause, ...]]  # of the model, of the inputs


def _only(causes: _Causes, *, of_springs: bool) -> _Causes:
    model, inputs = (tuple(one for one in share if one.of_springs is of_springs) for share in causes)
    return model, inputs


def makeup(case: Case, printed: PrintedSprings, found: SceneResponse) -> dict[str, Any]:
    """Return `error_makeup` as plain data by the name of the number; K_l and K_h are null where they are not made.

    P_max has the share by which the response of this very scene differs from it too.
    """
    made = error_makeup(case, printed)
    made = replace(made, P_max=_with_scene(made.P_max, case.judged(printed.stiffnesses).P_max()[0], found))
    return {name: None if one is None else one.entry() for name, one in vars(made).items()}


def _with_scene(P_max: NumberError, level: float, found: SceneResponse) -> NumberError:
    """Return the make-up with what curved fruit, tilt and the tips' shape do to P at full travel, where they act."""
    last = float(found.responses[-1].P[-1])
    if not found.cells or not math.isfinite(last) or last == level:
        return P_max
    reason = f"the scene's own response at {found.responses[-1].E:g} MPa and full travel is {last:.4g}"
    effect = Effect(effect="shape and pose", size_percent=100.0 * (last / level - 1.0), reason=reason)
    return replace(P_max, model=(*P_max.model, effect))


def error_makeup(case: Case, printed: PrintedSprings, slopes: Pair = BEAM_SLOPES) -> Makeup:
    """Return the make-up of the error of each number; `slopes` are those of ln K over ln t of low and high leaves.

    Raises ValueError where a share is empty or a size is not a number.
    """
    judged, targets = case.judged(printed.stiffnesses, printed.errors), case.design.targets
    left_out = (*_spring_effects(case, printed, slopes), *_flesh_effects(case, judged))
    causes = left_out, tuple(_inputs(case, printed, slopes))
    (P, P_error), (NL, NL_error) = judged.P_max(), judged.NL(targets)
    law = partial(_law_changes, judged, targets.NL_definition)
    return Makeup(
        K_l=_spring_error(printed.low.error_percent, causes, 0),
        K_h=_spring_error(printed.high.error_percent, causes, 1),
        P_max=_number_error(100.0 * P_error / P, causes, lambda cause, sign: law(cause, sign)[0] / P),
        NL=_number_error(100.0 * NL_error / NL, causes, lambda cause, sign: law(cause, sign)[1] / NL),
        contact=_number_error(
            case.contact.error_percent,
            _only(causes, of_springs=False),
            lambda cause, sign: -sign * cause.most[2] / (1.0 + sign * cause.most[2]),
        ),
    )


def _spring_error(error_percent: float | None, causes: _Causes, index: int) -> NumberError | None:
    if error_percent is None:
        return None
    return _number_error(error_percent, _only(causes, of_springs=True), lambda cause, sign: sign * cause.most[index])


def _number_error(bar: float, causes: _Causes, change: Callable[[_Cause, float], float]) -> NumberError:
    """Return the make-up of a number from the relative change by a cause; an input goes either way, half the range."""

    def effect(cause: _Cause, size: float) -> Effect:
        return Effect(effect=cause.effect, size_percent=100.0 * size, reason=cause.reason)

    return NumberError(
        discretisation_percent=bar,
        model=tuple(effect(one, change(one, 1.0)) for one in causes[0]),
        inputs=tuple(effect(one, 0.5 * abs(change(one, 1.0) - change(one, -1.0))) for one in causes[1]),
    )


def _rise(judged: Judged, K_m: float, moved: Moved) -> float:
    """Return P - P(0) at a fruit stiffness with all four stiffnesses moved: the two-spring law, (3)."""
    K_l, K_h, low, high = (1.0 + one for one in moved)
    q = judged.asymmetry
    force_high = series_stiffness(judged.springs.K_h * K_h, q * K_m * high)
    return force_high / series_stiffness(judged.springs.K_l * K_l, K_m * low) - q


def _law_changes(judged: Judged, definition: Definition, cause: _Cause, sign: float) -> Pair:
    """Return the changes of P_max and of NL, which is the share of its rise that P has made at one place, (7)."""
    K_h, last = judged.springs.K_h / judged.asymmetry, judged.K_m_max
    middle = 0.5 * last if definition == "mid-range" else stiffness_at_largest_nonlinearity(K_h, last)
    factor = max(1.0, FELT / max(map(abs, cause.most)))

    def rise(K_m: float, times: float) -> float:
        a, b, c, d = (times * one for one in cause.at(K_m))
        return _rise(judged, K_m, (a, b, c, d))

    most, moved = rise(last, 0.0), rise(last, sign * factor)
    return (moved - most) / factor, (rise(middle, sign * factor) / moved - rise(middle, 0.0) / most) / factor


def _deflections(case: Case, judged: Judged, K_m: float) -> Pair:
    """Return how far low and high spring give at full travel of a level sensor [mm]."""
    travel, springs = max(FELT, case.design.press.travel_mm), judged.springs
    tips = ((springs.K_l, K_m), (springs.K_h, judged.asymmetry * K_m))
    low, high = (travel * series_stiffness(K, fruit) / K for K, fruit in tips)
    return low, high


def _spring_effects(case: Case, printed: PrintedSprings, slopes: Pair) -> Iterator[_Cause]:
    """Yield what the FE of the springs leaves out; nothing where no springs are made."""
    if printed.housing is None:
        return
    process, judged = printed.process, case.judged(printed.stiffnesses)
    leaves = (printed.housing.low, printed.housing.high)

    def stiffened(deflections: Pair) -> Moved:
        low, high = (
            large_deflection_stiffening(leaf.length, min(d, LONGEST_SHARE * leaf.length))
            for leaf, d in zip(leaves, deflections, strict=True)
        )
        return low, high, 0.0, 0.0

    level = _deflections(case, judged, case.sizing.K_m_top)
    full = max(level[0], printed.deflections[0]), max(level[1], printed.deflections[1])
    # A bound: FE of the default housing at full travel has 0.93 and 0.37 of it.
    reason = f"elastica of leaves bent by {full[0]:.3g} and {full[1]:.3g} mm at full travel"
    yield _Cause("large deflection", reason, stiffened(full), lambda K_m: stiffened(_deflections(case, judged, K_m)))
    shares = [
        share * K / (process.E_MPa * leaf.depth) * ENGRAVED_MM / (leaf.depth - ENGRAVED_MM)
        for share, K, leaf in zip(FRAME_SHARES, (judged.springs.K_l, judged.springs.K_h), leaves, strict=True)
    ]
    reason = f"at most: the whole frame thinner by the {ENGRAVED_MM:g} mm that the marks are deep"
    yield _constant("engraved marks", reason, (-shares[0], -shares[1], 0.0, 0.0))
    if process.line_width_mm is not None:
        foot = [
            FOOT_HIGH_MM / leaf.depth * math.expm1(slope * math.log1p(2.0 * FOOT_MM / leaf.thickness))
            for leaf, slope in zip(leaves, slopes, strict=True)
        ]
        reason = f"a first layer {FOOT_MM:g} mm wider on each side, {FOOT_HIGH_MM:g} mm high; cut it off or calibrate"
        yield _constant("foot of the print", reason, (foot[0], foot[1], 0.0, 0.0))


def _flesh_effects(case: Case, judged: Judged) -> Iterator[_Cause]:
    """Yield what the contact leaves out: grip between tip and skin, and large strain of the flesh."""
    side, travel, poisson = case.design.tips.side_mm, max(FELT, case.design.press.travel_mm), case.design.fruit.poisson

    def pressed(size: Callable[[float], float]) -> tuple[Moved, Callable[[float], Moved]]:
        def at(K_m: float) -> Moved:
            low, high = (size((travel - one) / side) for one in _deflections(case, judged, K_m))
            return 0.0, 0.0, low, high

        return (0.0, 0.0, size(travel / side), size(travel / side)), at

    grip = no_slip(poisson)
    reason = "the tip slides on the skin; more where it does not, as a circle on a half-space (Spence 1968)"
    yield _constant("no slip", reason, (0.0, 0.0, grip, grip))
    deep = f"FE of one tip, {travel / side:.2g} tip sides deep at most"
    yield _Cause("large strain", deep, *pressed(lambda depth: -large_strain(depth, poisson)))
    yield _Cause("law of the flesh", f"{deep}; neo-Hooke, Hencky and foam apart, Poisson 0.3", *pressed(flesh_law))


def _inputs(case: Case, printed: PrintedSprings, slopes: Pair) -> Iterator[_Cause]:
    """Yield what the process does not hold, two sigma, alike on both springs and both tips as they are one print."""
    process, side = printed.process, case.design.tips.side_mm
    E, off = SIGMAS * process.E_scatter, process.accuracy_mm
    yield _constant("modulus", f"E of {process.name} within {100.0 * E:g} % from print to print", (E, E, 0.0, 0.0))
    leaves = (process.leaf_thickness_low_mm, process.leaf_thickness_high_mm)
    gauge = None if printed.housing is None else GAUGES[printed.housing.gauges]
    if gauge is not None and printed.housing is not None:
        glued = [
            GLUED
            * (1.0 - 1.0 / sandwich_gain(process.E_MPa, (one.depth, one.thickness), one.length, one.fillet, gauge))
            for one in (printed.housing.low, printed.housing.high)
        ]
        reason = f"glue left out, foils within {100.0 * GLUED:g} % of what they stiffen, as beams"
        yield _constant("gauges", reason, (glued[0], glued[1], 0.0, 0.0))
    thick = [math.expm1(slope * math.log1p(off / t)) for slope, t in zip(slopes, leaves, strict=True)]
    reason = f"leaves {off:g} mm off; K goes with t to the {slopes[0]:.3g} and {slopes[1]:.3g}"
    yield _constant("leaf thickness", reason, (thick[0], thick[1], 0.0, 0.0))
    off = GROUND_MM if case.design.tips.socket == "pin" else off
    wide, soft = min(LARGEST_LOSS, off / side), -min(LARGEST_LOSS, ROUNDING * off / side)
    yield _constant("tip side", f"tips {off:g} mm off; the fruit's goes with the side", (0.0, 0.0, wide, wide))
    yield _constant("tip edge", f"edges rounded by {off:g} mm, softer at first touch", (0.0, 0.0, soft, soft))
