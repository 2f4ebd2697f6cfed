"""What moves the springs: effects that their FE leaves out, other mounts, the scatter of their process."""

import math
from collections.abc import Mapping, Sequence

from cad.parts.housing import ENGRAVED_MM
from cad.quantity import COVERAGE
from cad.theory.elastica import large_deflection_stiffening
from cad.theory.leaf_spring import Flexure
from cad.theory.strain_gauge import GAUGES, sandwich_gain
from pipeline.response.characteristics import LONGEST_SHARE
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.verdicts.errors.cause import Cause, PerTip, Sensor

# How far the first layer of a print spreads on each side of a leaf, and how high: a judgement, one layer of 0.2 mm.
FOOT_MM, FOOT_HIGH_MM = 0.15, 0.2
GLUED = 0.25  # of what gauges stiffen: a judgement, as makers give neither the fill of a grid nor the glue
# Share of the frame in 1/K times E w / K: 0.08 and 0.6 % at K 0.753 and 17.3 N/mm, E 2000 MPa, w 6 mm. It covers leaves
# of plastic; the long leaves of steel see 6 to 7 times it, 0.005 and 0.04 %.
FRAME_SHARES = (0.0008 * 12000.0 / 0.753, 0.006 * 12000.0 / 17.3)  # fitted by tests/fits/frame_share.py


def spring_effects(sensor: Sensor, gives: Sequence[float]) -> tuple[Cause, ...]:
    """Return what the FE of the springs leaves out [1]; nothing where no springs are made."""
    housing, process = sensor.springs.housing, sensor.springs.process
    if housing is None:
        return ()
    leaves = [arm.flexure for arm in housing.arms]
    stiffer = tuple(
        large_deflection_stiffening(leaf.length, min(give, LONGEST_SHARE * leaf.length))
        for leaf, give in zip(leaves, gives, strict=True)
    )
    shown = " and ".join(f"{give:.3g}" for give in gives)
    bent = Cause(effect="large deflection", reason=f"elastica of leaves bent by {shown} mm", springs=stiffer)
    foot = () if process.line_width_mm is None else (_elephants_foot(leaves, sensor.slopes),)
    return bent, _engraved_marks(leaves, sensor.own.springs.stiffnesses, process.E_MPa), *foot


def _engraved_marks(leaves: Sequence[Flexure], stiffnesses: Sequence[float], E: float) -> Cause:
    """Return what the marks take from the frame of springs [N/mm] of a plastic or metal of modulus E [MPa]."""
    marked = tuple(
        -share * K / (E * leaf.depth) * ENGRAVED_MM / (leaf.depth - ENGRAVED_MM)
        for share, K, leaf in zip(FRAME_SHARES, stiffnesses, leaves, strict=True)
    )
    reason = f"at most: the whole frame thinner by the {ENGRAVED_MM:g} mm that the marks are deep"
    return Cause(effect="engraved marks", reason=reason, springs=marked, calibrated=True)


def _elephants_foot(leaves: Sequence[Flexure], slopes: Sequence[float]) -> Cause:
    """Return what a first layer that spreads adds to the leaves; `slopes` are those of ln K over ln t [1]."""
    wider = tuple(
        FOOT_HIGH_MM / leaf.depth * math.expm1(slope * math.log1p(2.0 * FOOT_MM / leaf.thickness))
        for leaf, slope in zip(leaves, slopes, strict=True)
    )
    reason = f"a first layer {FOOT_MM:g} mm wider on each side, {FOOT_HIGH_MM:g} mm high; cut it off or calibrate"
    return Cause(effect="elephant's foot", reason=reason, springs=wider, calibrated=True)


def other_mount(mounts: Mapping[str, PerTip]) -> tuple[Cause, ...]:
    """Return the mount that changes a stiffness most, the others in its reason; none where no springs are made."""
    if not mounts:
        return ()
    worst = max(mounts, key=lambda name: max(map(abs, mounts[name])))
    listed = "; ".join(
        f"{name} {' and '.join(f'{100.0 * change:+.2g}' for change in changes)} %" for name, changes in mounts.items()
    )
    return (
        Cause(
            effect="mount", reason=f"another mount than the sheet's: {listed}", springs=mounts[worst], calibrated=True
        ),
    )


def print_causes(sensor: Sensor) -> tuple[Cause, ...]:
    """Return what the process does not hold of the springs, alike on all of them as they are one print."""
    process = sensor.springs.process
    E, off = COVERAGE * process.E_scatter, process.accuracy_mm  # the accuracy of a process holds 95 % already
    leaves = process.leaf_thicknesses_mm
    slopes = sensor.slopes
    thicker = tuple(math.expm1(slope * math.log1p(off / t)) for slope, t in zip(slopes, leaves, strict=True))
    varied = f"E of {process.name} within {100.0 * E:g} % from print to print"
    shifted = f"leaves {off:g} mm off; K goes with t to the {slopes[0]:.3g} and {slopes[1]:.3g}"
    glue = f"glue left out, foils within {100.0 * GLUED:g} % of what they stiffen, as beams"
    return (
        Cause(effect="modulus", reason=varied, springs=(E, E), calibrated=True),
        Cause(effect="gauges", reason=glue, springs=_glued(sensor.springs), calibrated=True),
        Cause(effect="leaf thickness", reason=shifted, springs=thicker, calibrated=True),
    )


def _glued(springs: FittedSprings) -> PerTip:
    """Return what glue and foils leave open of each spring's stiffness [1]; 0 without gauges."""
    housing, E = springs.housing, springs.process.E_MPa
    gauge = None if housing is None else GAUGES[housing.gauges]
    if housing is None or gauge is None:
        return (0.0, 0.0)
    leaves = [arm.flexure for arm in housing.arms]
    gains = [sandwich_gain(E, leaf.depth, leaf.thickness, leaf.length, leaf.fillet, gauge) for leaf in leaves]
    return tuple(GLUED * (1.0 - 1.0 / gain) for gain in gains)
