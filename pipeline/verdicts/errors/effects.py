"""What moves the numbers of a sensor beside their numerical error: a function an effect, all listed in `effects_on`.

An effect is either left out by the model, or the scatter of an input, two sigma. It changes the stiffness of a spring,
that of the fruit under a tip, or the height of a tip; budget.py turns that into contributions to each number.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cad.design.parameters import Design
from cad.parts.housing import ENGRAVED_MM
from cad.quantity import COVERAGE
from cad.theory.elastica import large_deflection_stiffening
from cad.theory.free_fruit import Roll, roll
from cad.theory.rounded_edge import edge_loss
from cad.theory.sloped_skin import frictionless_press
from cad.theory.soft_tissue import LARGEST_CHANGE, constitutive_spread, large_strain_factor, no_slip
from cad.theory.strain_gauge import GAUGES, sandwich_gain
from cad.theory.two_spring_law import series_stiffness, spring_give
from pipeline.response.scene_press import scene_of
from pipeline.springs.behaviour import LONGEST_SHARE
from pipeline.springs.fitted_springs import FittedSprings, tip_height_offsets
from pipeline.springs.sizing import SpringSizing
from pipeline.verdicts.targets import Characteristic, characteristic
from solve.fruit.compliance import FruitCompliance

PerTip = tuple[float, ...]

BEAM_SLOPES = (3.0, 3.0)  # of ln K over ln t: a beam's, which solids stay under
LEAST_TRAVEL = 1e-6  # [mm] an effect of a smaller travel is taken at this one
INCOMPRESSIBLE = 0.5  # Poisson's ratio
# How far the first layer of a print spreads on each side of a leaf, and how high: a judgement, one layer of 0.2 mm.
FOOT_MM = 0.15
FOOT_HIGH_MM = 0.2
GLUED = 0.25  # of what gauges stiffen: a judgement, as makers give neither the fill of a grid nor the glue
# Fraction of the frame in 1/K times E w / K: 0.08 and 0.6 % at K 0.753 and 17.3 N/mm, E 2000 MPa, w 6 mm. It covers
# leaves of plastic; the long leaves of steel see 6 to 7 times it, 0.005 and 0.04 %. Fitted by tests/fits/frame_share.py
FRAME_FRACTIONS = (0.0008 * 12000.0 / 0.753, 0.006 * 12000.0 / 17.3)
CALIBRATED = 0.01  # of each stiffness: what weighing a printed unit reaches
ZEROED_MM = 0.01  # what zeroing on a flat plate leaves between the heights of two tips: a judgement


@dataclass(frozen=True, kw_only=True)
class Effect:
    """What moves a number: relative changes of each spring and of the fruit under each tip [1], height offsets [mm].

    `scatters` says that it is an input known within a range, which goes either way; else the model leaves it out.
    `calibrated` says that calibrating the printed unit takes it away.
    """

    name: str
    reason: str
    springs: PerTip = (0.0, 0.0)
    fruit: PerTip = (0.0, 0.0)
    height_offsets: PerTip = (0.0, 0.0)
    scatters: bool = False
    calibrated: bool = False


NO_EFFECT = Effect(name="", reason="")


@dataclass(frozen=True, kw_only=True)
class LevelSensor:
    """What effects act on: the pair that stands for a design, pressed level, and the law of its force ratio.

    `mounts` are the relative changes of each spring in other mounts [1], by name; `slopes` those of ln K over ln t of
    the leaves of each spring [1].
    """

    design: Design
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings
    characteristic: Characteristic
    mounts: Mapping[str, PerTip]
    slopes: PerTip = BEAM_SLOPES

    def deflections(self, K_m: float, travel: float) -> PerTip:
        """Return the deflection of each spring at a fruit stiffness [N/mm] and a travel [mm]."""
        travel = max(LEAST_TRAVEL, travel)
        law = self.characteristic
        return (
            spring_give(law.springs.K_l, K_m, travel),
            spring_give(law.springs.K_h, law.stiffness_ratio * K_m, travel),
        )

    @property
    def largest_deflections(self) -> PerTip:
        """Return the largest deflection of each spring [mm], in the scene or level, at full travel."""
        level = self.deflections(self.sizing.K_m_at_largest_E, self.design.press.travel_mm)
        return tuple(max(pair) for pair in zip(level, self.springs.deflections, strict=True))


def level_sensor(
    design: Design,
    contact: FruitCompliance,
    sizing: SpringSizing,
    springs: FittedSprings,
    mounts: Mapping[str, PerTip],
    slopes: PerTip = BEAM_SLOPES,
) -> LevelSensor:
    """Return what effects act on; a pair stands for more tips than two."""
    contact = contact.per_spring(*design.tips.spring_groups)
    springs = springs.per_spring
    return LevelSensor(
        design=design.per_spring,
        contact=contact,
        sizing=sizing,
        springs=springs,
        characteristic=characteristic(contact, sizing, springs.stiffnesses, springs.errors),
        mounts=mounts,
        slopes=slopes,
    )


def effects_on(sensor: LevelSensor, travel: float, deflections: PerTip) -> tuple[Effect, ...]:
    """Return all effects at a travel [mm] where the springs deflect that far [mm]."""
    design = sensor.design
    travelled = max(LEAST_TRAVEL, travel)
    depths = tuple((travelled - deflection) / design.tips.side_mm for deflection in deflections)
    off = sensor.springs.edge_radius(design.tips)
    listed = (
        large_deflection(sensor, deflections),
        engraved_marks(sensor),
        elephants_foot(sensor),
        other_mount(sensor.mounts),
        grip(design),
        large_strain(design, depths),
        law_of_the_flesh(design, depths),
        sliding_on_slope(design),
        sideways_give(sensor, travelled, deflections),
        free_fruit(sensor, travel),
        print_modulus(sensor),
        glue(sensor),
        leaf_thickness(sensor),
        tip_side(design, off),
        tip_edge(design, off, travelled, deflections),
        tip_height(off),
        poisson_ratio(design),
        pose(design),
        weight(sensor),
    )
    return tuple(effect for effect in listed if effect is not None)


def effects_after_calibration(effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """Return what calibrating a unit leaves: each stiffness known to 1 %, the tips zeroed."""
    known = f"known to {100.0 * CALIBRATED:g} %"
    zeroed = f"tips zeroed on a flat plate to {ZEROED_MM:g} mm"
    half = 0.5 * ZEROED_MM
    return (
        *(effect for effect in effects if not effect.calibrated),
        Effect(name="low spring", reason=known, springs=(CALIBRATED, 0.0), scatters=True),
        Effect(name="high spring", reason=known, springs=(0.0, CALIBRATED), scatters=True),
        Effect(name="tip height", reason=zeroed, height_offsets=(-half, half), scatters=True),
    )


# What the model leaves out: of the springs


def large_deflection(sensor: LevelSensor, deflections: PerTip) -> Effect | None:
    """Return how bent leaves stiffen; None where no springs are made."""
    housing = sensor.springs.housing
    if housing is None:
        return None
    stiffer = []
    for arm, deflection in zip(housing.arms, deflections, strict=True):
        length = arm.flexure.length
        stiffer.append(large_deflection_stiffening(length, min(deflection, LONGEST_SHARE * length)))
    bent = " and ".join(f"{deflection:.3g}" for deflection in deflections)
    return Effect(name="large deflection", reason=f"elastica of leaves bent by {bent} mm", springs=tuple(stiffer))


def engraved_marks(sensor: LevelSensor) -> Effect | None:
    """Return what engraved marks take from the stiffness of the frame; None where no springs are made."""
    housing = sensor.springs.housing
    if housing is None:
        return None
    E = sensor.springs.process.E_MPa
    softer = []
    rows = zip(housing.arms, FRAME_FRACTIONS, sensor.characteristic.springs.stiffnesses, strict=True)
    for arm, fraction, K in rows:
        depth = arm.flexure.depth
        softer.append(-fraction * K / (E * depth) * ENGRAVED_MM / (depth - ENGRAVED_MM))
    reason = f"at most: the whole frame thinner by the {ENGRAVED_MM:g} mm that the marks are deep"
    return Effect(name="engraved marks", reason=reason, springs=tuple(softer), calibrated=True)


def elephants_foot(sensor: LevelSensor) -> Effect | None:
    """Return what a first layer that spreads adds to the leaves; None for processes without layers of lines."""
    housing = sensor.springs.housing
    if housing is None or sensor.springs.process.line_width_mm is None:
        return None
    stiffer = []
    for arm, slope in zip(housing.arms, sensor.slopes, strict=True):
        leaf = arm.flexure
        thicker = (leaf.thickness + 2.0 * FOOT_MM) / leaf.thickness
        of_depth = FOOT_HIGH_MM / leaf.depth
        stiffer.append(of_depth * (thicker**slope - 1.0))
    reason = f"a first layer {FOOT_MM:g} mm wider on each side, {FOOT_HIGH_MM:g} mm high; cut it off or calibrate"
    return Effect(name="elephant's foot", reason=reason, springs=tuple(stiffer), calibrated=True)


def other_mount(mounts: Mapping[str, PerTip]) -> Effect | None:
    """Return the mount that changes a stiffness most, the others in its reason; None where no springs are made."""
    if not mounts:
        return None
    worst = max(mounts, key=lambda name: max(map(abs, mounts[name])))
    listed = []
    for name, changes in mounts.items():
        percents = " and ".join(f"{100.0 * change:+.2g}" for change in changes)
        listed.append(f"{name} {percents} %")
    reason = f"another mount than the sheet's: {'; '.join(listed)}"
    return Effect(name="mount", reason=reason, springs=mounts[worst], calibrated=True)


# What the model leaves out: of the fruit


def grip(design: Design) -> Effect:
    """Return how a tip that does not slip stiffens the fruit (Spence 1968)."""
    stiffer = no_slip(design.fruit.poisson)
    reason = "the tip slides on the skin; more where it does not, as a circle on a half-space (Spence 1968)"
    return Effect(name="no slip", reason=reason, fruit=(stiffer, stiffer))


def large_strain(design: Design, depths: PerTip) -> Effect | None:
    """Return how the fruit stiffens at depths [tip sides]; None where large strain is solved."""
    if design.press.strain != "linear":
        return None
    stiffer = tuple(large_strain_factor(depth, design.fruit.poisson) - 1.0 for depth in depths)
    return Effect(name="large strain", reason=_deep(depths), fruit=stiffer)


def law_of_the_flesh(design: Design, depths: PerTip) -> Effect:
    """Return how far laws of the flesh differ at depths [tip sides]."""
    apart = tuple(constitutive_spread(depth, design.fruit.poisson) for depth in depths)
    reason = f"{_deep(depths)}; Hencky and foam apart, with neo-Hooke between"
    return Effect(name="law of the flesh", reason=reason, fruit=apart)


def _deep(depths: PerTip) -> str:
    return f"FE of one tip, {max(depths):.2g} tip sides deep"


def sliding_on_slope(design: Design) -> Effect:
    """Return what a sloping skin under frictionless tips changes."""
    slopes = scene_of(design).slopes_deg
    changes = tuple(frictionless_press(design.fruit.poisson, math.tan(math.radians(angle))) for angle in slopes)
    steepest = max(map(abs, slopes))
    reason = f"a tip that slides on a skin falling by {steepest:.2g} deg presses along its normal"
    return Effect(name="slope", reason=reason, fruit=changes)


def sideways_give(sensor: LevelSensor, travel: float, deflections: PerTip) -> Effect | None:
    """Return what flat tips that slide on a slope give sideways; None for domes, whose law has it.

    The force leans by the slope: what a spring gives more counts as if the fruit under its tip were softer.
    """
    sideways = sensor.springs.sideways
    if sideways is None or sensor.design.tips.tip_shape.obeys_hertz:
        return None
    slopes = scene_of(sensor.design).slopes_deg
    changes = []
    for tip, deflection in enumerate(deflections):
        lean = np.array([math.tan(math.radians(slopes[tip])), 0.0, 1.0])
        more = float(lean @ sideways.compliance[tip, tip] @ lean / sensor.springs.C[tip, tip])
        depth = max(LEAST_TRAVEL, travel - deflection)
        changes.append(1.0 / (1.0 + more * deflection / depth) - 1.0)
    reason = f"a force that leans by {max(map(abs, slopes)):.2g} deg moves a tip sideways too"
    return Effect(name="sideways give", reason=reason, fruit=tuple(changes))


def free_fruit(sensor: LevelSensor, travel: float) -> Effect | None:
    """Return how a whole fruit that lies free on a table rolls; None for a part of one."""
    tips = sensor.design.tips
    rolled = free_roll(sensor, travel)
    if rolled is None:
        return None
    # A fruit that runs away takes a tip off: one more travel than there is.
    turn = math.radians(rolled.angle_deg) if rolled.steady else 2.0 * travel / tips.spacing_mm
    offsets = tuple(turn * x for x in tips.centres_mm)
    reason = f"a fruit that lies free on a table rolls, unless friction holds it: {rolled.friction:.2g} is enough"
    return Effect(name="free fruit", reason=reason, height_offsets=offsets)


def free_roll(sensor: LevelSensor, travel: float) -> Roll | None:
    """Return how the tips roll a whole fruit that lies free, at E_max and a travel [mm]; None for a part of one."""
    fruit = sensor.design.fruit
    if not fruit.can_roll or fruit.radius_mm is None:
        return None
    law = sensor.characteristic
    stiffness = [
        series_stiffness(law.springs.K_l, law.K_m_max),
        series_stiffness(law.springs.K_h, law.stiffness_ratio * law.K_m_max),
    ]
    forces = [K * travel for K in stiffness]
    return roll(forces, sensor.design.tips.centres_mm, stiffness, fruit.radius_mm)


# How inputs scatter: of the print, alike on all springs as they are one print


def print_modulus(sensor: LevelSensor) -> Effect:
    """Return how the modulus of the process scatters from print to print."""
    process = sensor.springs.process
    E = COVERAGE * process.E_scatter
    reason = f"E of {process.name} within {100.0 * E:g} % from print to print"
    return Effect(name="modulus", reason=reason, springs=(E, E), scatters=True, calibrated=True)


def glue(sensor: LevelSensor) -> Effect | None:
    """Return what glue and foils leave open of each spring's stiffness; None without gauges."""
    housing = sensor.springs.housing
    gauge = None if housing is None else GAUGES[housing.gauges]
    if housing is None or gauge is None:
        return None
    E = sensor.springs.process.E_MPa
    stiffer = []
    for arm in housing.arms:
        leaf = arm.flexure
        gain = sandwich_gain(E, leaf.depth, leaf.thickness, leaf.length, leaf.fillet, gauge)
        by_foils = 1.0 - 1.0 / gain  # fraction of the stiffness
        stiffer.append(GLUED * by_foils)
    reason = f"glue left out, foils within {100.0 * GLUED:g} % of what they stiffen, as beams"
    return Effect(name="gauges", reason=reason, springs=tuple(stiffer), scatters=True, calibrated=True)


def leaf_thickness(sensor: LevelSensor) -> Effect:
    """Return what leaves do that are off by the accuracy of the process, which holds 95 % already."""
    process = sensor.springs.process
    off = process.accuracy_mm
    slopes = sensor.slopes
    stiffer = []
    for slope, thickness in zip(slopes, process.leaf_thicknesses_mm, strict=True):
        thicker = (thickness + off) / thickness
        stiffer.append(thicker**slope - 1.0)
    reason = f"leaves {off:g} mm off; K goes with t to the {slopes[0]:.3g} and {slopes[1]:.3g}"
    return Effect(name="leaf thickness", reason=reason, springs=tuple(stiffer), scatters=True, calibrated=True)


# How inputs scatter: of tips that are off by a length [mm]


def tip_side(design: Design, off: float) -> Effect:
    """Return what wider tips do: the fruit's stiffness goes with the side."""
    wider = min(LARGEST_CHANGE, off / design.tips.side_mm)
    reason = f"tips {off:g} mm off; the fruit's goes with the side"
    return Effect(name="tip side", reason=reason, fruit=(wider, wider), scatters=True)


def tip_edge(design: Design, off: float, travel: float, deflections: PerTip) -> Effect:
    """Return what rounded edges do at the depth of each tip."""
    softer = tuple(-edge_loss(travel - deflection, design.tips.side_mm, off) for deflection in deflections)
    reason = f"edges rounded by {off:g} mm, at the depth of each tip"
    return Effect(name="tip edge", reason=reason, fruit=softer, scatters=True)


def tip_height(off: float) -> Effect:
    """Return what tips of different heights do."""
    reason = f"{off:g} mm between the tips; zero the tips on a flat plate"
    half = 0.5 * off
    return Effect(name="tip height", reason=reason, height_offsets=(-half, half), scatters=True, calibrated=True)


# How inputs scatter: of fruit and pose


def poisson_ratio(design: Design) -> Effect:
    """Return what the spread of Poisson's ratio does to the fruit."""
    fruit = design.fruit
    largest = min(INCOMPRESSIBLE, abs(fruit.poisson) + fruit.poisson_spread)
    change = (1.0 - fruit.poisson**2) / (1.0 - largest**2) - 1.0
    reason = f"within {fruit.poisson_spread:g}; the fruit's goes with 1 / (1 - nu^2), as on a half-space"
    return Effect(name="Poisson's ratio", reason=reason, fruit=(change, change), scatters=True)


def pose(design: Design) -> Effect:
    """Return what the spread of the tilt does to the heights of the tips."""
    degrees = design.press.tilt_spread_deg
    step = 0.5 * design.tips.spacing_mm * math.tan(math.radians(degrees))
    reason = f"the sensor tilted by {degrees:g} deg"
    return Effect(name="pose", reason=reason, height_offsets=(-step, step), scatters=True)


def weight(sensor: LevelSensor) -> Effect | None:
    """Return what the weight of the moving parts does to a sensor for sideways use when it presses down."""
    offsets = tip_height_offsets(sensor.springs, "down") if sensor.design.press.attitude == "side" else ()
    if not offsets:
        return None
    apart = max(offsets) - min(offsets)
    reason = f"pressed down, not sideways, its tips stand {apart:.2g} mm off level; see press.attitude, or zero them so"
    return Effect(name="weight", reason=reason, height_offsets=offsets, scatters=True, calibrated=True)
