"""What moves a number beside its numerical error: effects that the model leaves out, and the scatter of the inputs."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cad.design.parameters import Design
from cad.parts.engraving import ENGRAVED_MM
from cad.theory.elastica import large_deflection_stiffening
from cad.theory.leaf_spring import Flexure
from cad.theory.rounded_edge import edge_loss
from cad.theory.soft_tissue import LARGEST_LOSS, constitutive_spread, large_strain, no_slip
from cad.theory.strain_gauge import GAUGES, sandwich_gain
from cad.theory.two_spring_law import series_stiffness
from pipeline.stages.characteristics import LONGEST_SHARE
from pipeline.stages.sizing import SpringSizing
from pipeline.stages.springs import FittedSprings
from pipeline.verdicts.characteristic import Characteristic, characteristic
from solve.fruit.compliance import FruitCompliance

PerTip = tuple[float, ...]

SIGMAS = 2.0  # which accuracy_mm of a process is
BEAM_SLOPES = (3.0, 3.0)  # of ln K over ln t: a beam's, which solids stay under
# How far the first layer of a print spreads on each side of a leaf, and how high: a judgement, one layer of 0.2 mm.
FOOT_MM, FOOT_HIGH_MM = 0.15, 0.2
GLUED = 0.25  # of what gauges stiffen: a judgement, as makers give neither the fill of a grid nor the glue
# Share of the frame in 1/K times E w / K: 0.08 and 0.6 % at K 0.753 and 17.3 N/mm, E 2000 MPa, w 6 mm. It covers leaves
# of plastic; the long leaves of steel see 6 to 7 times it, 0.005 and 0.04 %.
FRAME_SHARES = (0.0008 * 12000.0 / 0.753, 0.006 * 12000.0 / 17.3)  # fitted by tests/fits/frame_share.py
LEAST_TRAVEL = 1e-6  # [mm] an effect of a smaller travel is taken at this one
CALIBRATED = 0.01  # of each stiffness: what weighing a printed unit reaches
ZEROED_MM = 0.01  # what zeroing on a flat plate leaves between the heights of two tips: a judgement
INCOMPRESSIBLE = 0.5  # Poisson's ratio


@dataclass(frozen=True, kw_only=True)
class Cause:
    """What moves a number: relative changes of each spring and of the fruit under each tip [1], leads of tips [mm].

    `calibrated` says that calibrating the printed unit takes it away.
    """

    effect: str
    reason: str
    springs: PerTip = (0.0, 0.0)
    fruit: PerTip = (0.0, 0.0)
    lead: PerTip = (0.0, 0.0)
    calibrated: bool = False


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """What causes act on: a design with its contact, its sized and its fitted springs, and the law that judges them.

    `slopes` are those of ln K over ln t of the leaves of each spring [1].
    """

    design: Design
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings
    own: Characteristic
    slopes: Sequence[float] = BEAM_SLOPES

    def gives(self, K_m: float, travel: float) -> PerTip:
        """Return how far each spring of a level sensor gives at a fruit stiffness [N/mm] and a travel [mm]."""
        travel = max(LEAST_TRAVEL, travel)
        fruit = (K_m, self.own.stiffness_ratio * K_m)
        pairs = zip(self.own.springs.stiffnesses, fruit, strict=True)
        return tuple(travel * series_stiffness(K, stiffness) / K for K, stiffness in pairs)

    @property
    def largest_gives(self) -> PerTip:
        """Return how far each spring gives at most [mm], in the scene or level, at full travel."""
        level = self.gives(self.sizing.K_m_at_largest_E, self.design.press.travel_mm)
        return tuple(max(pair) for pair in zip(level, self.springs.deflections, strict=True))


def assessed_sensor(
    design: Design,
    contact: FruitCompliance,
    sizing: SpringSizing,
    springs: FittedSprings,
    slopes: Sequence[float] = BEAM_SLOPES,
) -> Sensor:
    """Return what the causes of errors act on; `slopes` are those of ln K over ln t of each spring's leaves [1]."""
    own = characteristic(contact, sizing, springs.stiffnesses, springs.errors)
    return Sensor(design=design, contact=contact, sizing=sizing, springs=springs, own=own, slopes=slopes)


def model_causes(sensor: Sensor, travel: float, gives: Sequence[float]) -> tuple[Cause, ...]:
    """Return what the model leaves out at a travel [mm] where the springs give that far [mm]."""
    return *_spring_effects(sensor, gives), *_flesh_effects(sensor.design, travel, gives)


def input_causes(sensor: Sensor, travel: float, gives: Sequence[float]) -> tuple[Cause, ...]:
    """Return what is not known of the inputs, two sigma, at a travel [mm] where the springs give that far [mm]."""
    design, radius = sensor.design, sensor.springs.edge_radius(sensor.design.tips)
    return *_print_scatter(sensor), *_tip_scatter(design, radius, travel, gives), *_fruit_and_pose(design)


def calibrated_causes(causes: Iterable[Cause]) -> tuple[Cause, ...]:
    """Return what is left of inputs after calibrating a unit: each stiffness known to 1 %, the tips zeroed."""
    reason = f"known to {100.0 * CALIBRATED:g} %"
    zeroed = f"tips zeroed on a flat plate to {ZEROED_MM:g} mm"
    return (
        *(cause for cause in causes if not cause.calibrated),
        Cause(effect="low spring", reason=reason, springs=(CALIBRATED, 0.0)),
        Cause(effect="high spring", reason=reason, springs=(0.0, CALIBRATED)),
        Cause(effect="tip height", reason=zeroed, lead=(-0.5 * ZEROED_MM, 0.5 * ZEROED_MM)),
    )


def _spring_effects(sensor: Sensor, gives: Sequence[float]) -> tuple[Cause, ...]:
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


def _flesh_effects(design: Design, travel: float, gives: Sequence[float]) -> tuple[Cause, ...]:
    """Return what the contact leaves out: grip between tip and skin, and large strain of the flesh."""
    poisson, travel = design.fruit.poisson, max(LEAST_TRAVEL, travel)
    depths = [(travel - give) / design.tips.side_mm for give in gives]
    grip = "the tip slides on the skin; more where it does not, as a circle on a half-space (Spence 1968)"
    deep = f"FE of one tip, {max(depths):.2g} tip sides deep"
    stiffer = no_slip(poisson)
    strained = tuple(-large_strain(depth, poisson) for depth in depths)
    spread = tuple(constitutive_spread(depth) for depth in depths)
    apart = f"{deep}; neo-Hooke, Hencky and foam apart, Poisson 0.3"
    return (
        Cause(effect="no slip", reason=grip, fruit=(stiffer, stiffer)),
        Cause(effect="large strain", reason=deep, fruit=strained),
        Cause(effect="law of the flesh", reason=apart, fruit=spread),
    )


def _print_scatter(sensor: Sensor) -> tuple[Cause, ...]:
    """Return what the process does not hold of the springs, alike on all of them as they are one print."""
    process = sensor.springs.process
    E, off = SIGMAS * process.E_scatter, process.accuracy_mm
    leaves = (process.leaf_thickness_low_mm, process.leaf_thickness_high_mm)
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


def _tip_scatter(design: Design, off: float, travel: float, gives: Sequence[float]) -> tuple[Cause, ...]:
    """Return what tips that are off by a length [mm] in side, edge and height do."""
    side, travel = design.tips.side_mm, max(LEAST_TRAVEL, travel)
    softer = tuple(-edge_loss(travel - give, side, off) for give in gives)
    wider = min(LARGEST_LOSS, off / side)
    half = 0.5 * off
    flat = "zero the tips on a flat plate"
    return (
        Cause(effect="tip side", reason=f"tips {off:g} mm off; the fruit's goes with the side", fruit=(wider, wider)),
        Cause(effect="tip edge", reason=f"edges rounded by {off:g} mm, at the depth of each tip", fruit=softer),
        Cause(effect="tip height", reason=f"{off:g} mm between the tips; {flat}", lead=(-half, half), calibrated=True),
    )


def _fruit_and_pose(design: Design) -> tuple[Cause, ...]:
    """Return what the spread of Poisson's ratio does to the fruit, and that of the tilt to the travel of each tip."""
    fruit, degrees = design.fruit, design.press.tilt_spread_deg
    softer = min(INCOMPRESSIBLE, abs(fruit.poisson) + fruit.poisson_spread)
    change = (1.0 - fruit.poisson**2) / (1.0 - softer**2) - 1.0
    step = 0.5 * design.tips.spacing_mm * math.tan(math.radians(degrees))
    ratio = f"within {fruit.poisson_spread:g}; the fruit's goes with 1 / (1 - nu^2), as on a half-space"
    return (
        Cause(effect="Poisson's ratio", reason=ratio, fruit=(change, change)),
        Cause(effect="pose", reason=f"the sensor tilted by {degrees:g} deg", lead=(-step, step)),
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
