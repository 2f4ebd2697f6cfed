"""What moves a number beside its numerical error: effects that the model leaves out, and the scatter of the inputs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from cad.design.parameters import Design
from cad.parts.engraving import ENGRAVED_MM
from cad.theory.elastica import large_deflection_stiffening
from cad.theory.soft_tissue import LARGEST_LOSS, constitutive_spread, large_strain, no_slip
from cad.theory.strain_gauge import GAUGES, sandwich_gain
from cad.theory.two_spring_law import series_stiffness
from pipeline.stages.characteristics import LONGEST_SHARE
from pipeline.stages.sizing import SpringSizing
from pipeline.stages.springs import FittedSprings
from pipeline.stages.verdict_rules import Characteristic

Moved = tuple[float, float, float, float]
"""Relative changes of K_l, of K_h, and of the fruit's stiffness under the low and under the high tip [1]."""

SIGMAS = 2.0  # which accuracy_mm of a process is
BEAM_SLOPES = (3.0, 3.0)  # of ln K over ln t: a beam's, which solids stay under
# How far the first layer of a print spreads on each side of a leaf, and how high: a judgement, one layer of 0.2 mm.
FOOT_MM, FOOT_HIGH_MM = 0.15, 0.2
GLUED = 0.25  # of what gauges stiffen: a judgement, as makers give neither the fill of a grid nor the glue
GROUND_MM = 0.01  # of ground steel bar, as dealers sell it: typical, not a fit
# Share of the frame in 1/K times E w / K: 0.08 and 0.6 % at K 0.753 and 17.3 N/mm, E 2000 MPa, w 6 mm. It covers leaves
# of plastic; the long leaves of steel see 6 to 7 times it, 0.005 and 0.04 %.
FRAME_SHARES = (0.0008 * 12000.0 / 0.753, 0.006 * 12000.0 / 17.3)  # fitted by tests/fits/frame_share.py
# Loss of stiffness 0.01 sides deep over edge radius / side; 2.03 at the very first touch, 1.2 at 0.1 sides.
ROUNDING = 1.8  # fitted by tests/fits/rounded_edge.py
LEAST_TRAVEL = 1e-6  # [mm] an effect of a smaller travel is taken at this one


@dataclass(frozen=True, kw_only=True)
class Cause:
    """What moves the springs or the fruit: at the place of NL, at the largest fruit stiffness, and at most."""

    effect: str
    reason: str
    at_middle: Moved
    at_largest: Moved
    most: Moved

    def __post_init__(self) -> None:
        """Refuse a cause that moves nothing, which no number would list."""
        if not any(self.most):
            msg = (
                f"effect {self.effect!r} = 0 %, reason {self.reason!r}: must have a name, a finite size other than 0 "
                "and a reason; compute it"
            )
            raise ValueError(msg)

    @property
    def of_springs(self) -> bool:
        """Say whether it is the springs that it moves."""
        return any(self.most[:2])


def _of_springs(effect: str, reason: str, changes: Sequence[float]) -> Cause:
    moved = (changes[0], changes[1], 0.0, 0.0)
    return Cause(effect=effect, reason=reason, at_middle=moved, at_largest=moved, most=moved)


def _of_fruit(effect: str, reason: str, change: float) -> Cause:
    moved = (0.0, 0.0, change, change)
    return Cause(effect=effect, reason=reason, at_middle=moved, at_largest=moved, most=moved)


def deflections(design: Design, own: Characteristic, K_m: float) -> tuple[float, ...]:
    """Return how far each spring gives at full travel of a level sensor [mm] at a fruit stiffness [N/mm]."""
    travel = max(LEAST_TRAVEL, design.press.travel_mm)
    fruit = (K_m, own.stiffness_ratio * K_m)
    return tuple(
        travel * series_stiffness(K, stiffness) / K for K, stiffness in zip(own.springs.stiffnesses, fruit, strict=True)
    )


def spring_causes(
    design: Design, sizing: SpringSizing, springs: FittedSprings, own: Characteristic, slopes: Sequence[float]
) -> tuple[Cause, ...]:
    """Return what the FE of the springs leaves out [1]; nothing where no springs are made."""
    if springs.housing is None:
        return ()
    process, leaves = springs.process, [arm.flexure for arm in springs.housing.arms]
    causes = [_large_deflection(design, sizing, springs, own)]
    shares = [
        -share * K / (process.E_MPa * leaf.depth) * ENGRAVED_MM / (leaf.depth - ENGRAVED_MM)
        for share, K, leaf in zip(FRAME_SHARES, own.springs.stiffnesses, leaves, strict=True)
    ]
    reason = f"at most: the whole frame thinner by the {ENGRAVED_MM:g} mm that the marks are deep"
    causes.append(_of_springs("engraved marks", reason, shares))
    if process.line_width_mm is not None:
        wider = [
            FOOT_HIGH_MM / leaf.depth * math.expm1(slope * math.log1p(2.0 * FOOT_MM / leaf.thickness))
            for leaf, slope in zip(leaves, slopes, strict=True)
        ]
        reason = f"a first layer {FOOT_MM:g} mm wider on each side, {FOOT_HIGH_MM:g} mm high; cut it off or calibrate"
        causes.append(_of_springs("foot of the print", reason, wider))
    return tuple(causes)


def _large_deflection(design: Design, sizing: SpringSizing, springs: FittedSprings, own: Characteristic) -> Cause:
    """Return the stiffening of bent leaves, a bound: FE of the default housing has 0.93 and 0.37 of it."""
    level = deflections(design, own, sizing.K_m_at_largest_E)
    full = [max(pair) for pair in zip(level, springs.deflections, strict=True)]
    shown = " and ".join(f"{deflection:.3g}" for deflection in full)
    return Cause(
        effect="large deflection",
        reason=f"elastica of leaves bent by {shown} mm at full travel",
        at_middle=_stiffened(springs, deflections(design, own, own.K_m_of_NL(design.targets))),
        at_largest=_stiffened(springs, deflections(design, own, own.K_m_max)),
        most=_stiffened(springs, full),
    )


def _stiffened(springs: FittedSprings, given: Sequence[float]) -> Moved:
    """Return the stiffening of each spring at its deflection [mm]."""
    lengths = [spring.flexure.length for spring in springs.springs if spring.flexure is not None]
    stiffer = [
        large_deflection_stiffening(length, min(deflection, LONGEST_SHARE * length))
        for length, deflection in zip(lengths, given, strict=True)
    ]
    return stiffer[0], stiffer[1], 0.0, 0.0


def flesh_causes(design: Design, own: Characteristic) -> tuple[Cause, ...]:
    """Return what the contact leaves out: grip between tip and skin, and large strain of the flesh."""
    poisson = design.fruit.poisson
    depth = max(LEAST_TRAVEL, design.press.travel_mm) / design.tips.side_mm
    grip = "the tip slides on the skin; more where it does not, as a circle on a half-space (Spence 1968)"
    deep = f"FE of one tip, {depth:.2g} tip sides deep at most"
    middle, largest = (_depths(design, own, K_m) for K_m in (own.K_m_of_NL(design.targets), own.K_m_max))
    strained = [[-large_strain(each, poisson) for each in depths] for depths in (middle, largest, (depth, depth))]
    spread = [[constitutive_spread(each) for each in depths] for depths in (middle, largest, (depth, depth))]
    return (
        _of_fruit("no slip", grip, no_slip(poisson)),
        _by_depth("large strain", deep, strained),
        _by_depth("law of the flesh", f"{deep}; neo-Hooke, Hencky and foam apart, Poisson 0.3", spread),
    )


def _depths(design: Design, own: Characteristic, K_m: float) -> list[float]:
    """Return how deep each tip stands in the fruit at full travel, in tip sides [1]."""
    travel = max(LEAST_TRAVEL, design.press.travel_mm)
    return [(travel - give) / design.tips.side_mm for give in deflections(design, own, K_m)]


def _by_depth(effect: str, reason: str, changes: Sequence[Sequence[float]]) -> Cause:
    middle, largest, most = ((0.0, 0.0, change[0], change[1]) for change in changes)
    return Cause(effect=effect, reason=reason, at_middle=middle, at_largest=largest, most=most)


def print_causes(design: Design, springs: FittedSprings, slopes: Sequence[float]) -> tuple[Cause, ...]:
    """Return what the process does not hold, two sigma [1], alike on all springs and tips as they are one print."""
    process = springs.process
    E, off = SIGMAS * process.E_scatter, process.accuracy_mm
    causes = [_of_springs("modulus", f"E of {process.name} within {100.0 * E:g} % from print to print", (E, E))]
    glued = _glued(springs)
    if glued:
        reason = f"glue left out, foils within {100.0 * GLUED:g} % of what they stiffen, as beams"
        causes.append(_of_springs("gauges", reason, glued))
    leaves = (process.leaf_thickness_low_mm, process.leaf_thickness_high_mm)
    thicker = [math.expm1(slope * math.log1p(off / t)) for slope, t in zip(slopes, leaves, strict=True)]
    reason = f"leaves {off:g} mm off; K goes with t to the {slopes[0]:.3g} and {slopes[1]:.3g}"
    causes.append(_of_springs("leaf thickness", reason, thicker))
    return (*causes, *_tip_causes(design, GROUND_MM if design.tips.socket == "pin" else off))


def _tip_causes(design: Design, off: float) -> tuple[Cause, ...]:
    """Return what tips that are off by a length [mm] in side and edge do to the fruit's stiffness."""
    share = off / design.tips.side_mm
    wider, softer = min(LARGEST_LOSS, share), -min(LARGEST_LOSS, ROUNDING * share)
    return (
        _of_fruit("tip side", f"tips {off:g} mm off; the fruit's goes with the side", wider),
        _of_fruit("tip edge", f"edges rounded by {off:g} mm, softer at first touch", softer),
    )


def _glued(springs: FittedSprings) -> list[float]:
    """Return what glue and foils leave open of each spring's stiffness [1]; nothing without gauges."""
    housing, E = springs.housing, springs.process.E_MPa
    gauge = None if housing is None else GAUGES[housing.gauges]
    if housing is None or gauge is None:
        return []
    leaves = [arm.flexure for arm in housing.arms]
    gains = [sandwich_gain(E, leaf.depth, leaf.thickness, leaf.length, leaf.fillet, gauge) for leaf in leaves]
    return [GLUED * (1.0 - 1.0 / gain) for gain in gains]
