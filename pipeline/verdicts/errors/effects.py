"""What moves the numbers of a sensor beside their numerical error.

An effect is either left out by the model, or the scatter of an input, two sigma. It changes the stiffness of a spring,
that of the fruit under a tip, or the height of a tip. `budget.py` turns that into contributions to each number.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from cad.parts.housing import ENGRAVED_MM
from cad.parts.pin import tip_accuracy_mm
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import scene_of
from pipeline.springs.behaviour import stiffening
from pipeline.springs.fitted_springs import FittedSprings, tip_height_offsets
from pipeline.springs.sizing import SpringSizing
from pipeline.verdicts.targets import ForceRatioCurve, characteristic
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.design.reading import WEIGHED_AFTER_S
from sensor.quantity import COVERAGE
from sensor.theory.free_fruit import roll
from sensor.theory.rounded_edge import edge_loss
from sensor.theory.sloped_skin import frictionless_press
from sensor.theory.soft_tissue import LARGEST_CHANGE, constitutive_spread, large_strain_factor, no_slip
from sensor.theory.two_spring_law import series_stiffness, spring_give
from solve.fruit.compliance import FruitCompliance

PerTip = tuple[float, ...]

BEAM_SLOPE = 3.0  # of ln K over ln t: a beam's, which solids stay under
LEAST_TRAVEL = 1e-6  # [mm] an effect of a smaller travel is taken at this one
INCOMPRESSIBLE = 0.5  # Poisson's ratio
# How far the first layer of a print spreads on each side of a leaf, and how high: a judgement, one layer of 0.2 mm.
FOOT_MM = 0.15
FOOT_HIGH_MM = 0.2
# Fraction of the frame in 1/K times E w / K: 0.08 and 0.6 % at K 0.753 and 17.3 N/mm, E 2000 MPa, w 6 mm. It covers
# leaves of plastic; the long leaves of steel see 6 to 7 times it, 0.005 and 0.04 %.
# tests/reference/fits/test_housing.py
FRAME_FRACTIONS = (0.0008 * 12000.0 / 0.753, 0.006 * 12000.0 / 17.3)
# Largest change of the low and of the high spring by another mount, over presets, processes and mounts, with a margin
# of a quarter: docs/measurements.md#other-mounts. The low spring counts as softer and the high one as stiffer, which
# moves P most.
LARGEST_MOUNT_CHANGES = (-0.0011, 0.0086)
CALIBRATED = 0.01  # of each stiffness: what weighing a printed unit reaches
ZEROED_MM = 0.01  # what zeroing on a flat plate leaves between the heights of two tips: a judgement


@dataclass(frozen=True, kw_only=True, eq=False)
class Effect:
    """What moves a number: relative changes of each spring and of the fruit under each tip [1], height offsets [mm].

    All three have a row for each tip. Their shape is (2,) where all presses have the same, else (2, ...) with the shape
    of the presses.

    `scatters` says that it is an input known within a range, which goes either way; else the model leaves it out.
    `calibrated` says that calibrating the printed unit takes it away.
    """

    name: str
    reason: str
    springs: Floats = field(default_factory=lambda: np.zeros(2))
    fruit: Floats = field(default_factory=lambda: np.zeros(2))
    height_offsets: Floats = field(default_factory=lambda: np.zeros(2))
    scatters: bool = False
    calibrated: bool = False


NO_EFFECT = Effect(name="", reason="")


@dataclass(frozen=True, kw_only=True)
class LevelSensor:
    """The pair that stands for a design, pressed level, and the law of its force ratio: effects act on it."""

    design: Design
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings
    characteristic: ForceRatioCurve

    def deflections(self, K_m: Floats | float, travel: Floats | float) -> Floats:
        """Return the deflection of each spring (2, ...) at fruit stiffnesses [N/mm] and travels [mm] that broadcast."""
        travel = np.maximum(LEAST_TRAVEL, travel)
        law = self.characteristic
        K_m = np.asarray(K_m, dtype=np.float64)
        low = spring_give(law.springs.K_l, K_m, travel)
        high = spring_give(law.springs.K_h, np.asarray(law.stiffness_ratio * K_m), travel)
        return np.array([low, high])

    @property
    def largest_deflections(self) -> Floats:
        """Return the largest deflection of each spring (2,) [mm], in the scene or level, at full travel."""
        level = self.deflections(self.sizing.K_m_at_largest_E, self.design.press.travel_mm)
        return np.maximum(level, self.springs.deflections)

    @cached_property
    def effects_of_housing(self) -> tuple[Effect, ...]:
        """Return the effects that the model leaves out of springs that are made, but for their large deflection."""
        return tuple(_left_out_of_housing(self))

    @cached_property
    def scatter_of_prints(self) -> tuple[Effect, ...]:
        """Return the scatter of prints, the same for all springs as they are one print."""
        return tuple(_scatter_of_prints(self))

    @cached_property
    def scatter_of_scenes(self) -> tuple[Effect, ...]:
        """Return the scatter of fruit and press: Poisson's ratio, tilt, and the attitude of the sensor."""
        return tuple(_scatter_of_scenes(self))

    @cached_property
    def slopes_deg(self) -> tuple[float, ...]:
        """Return the slope of the skin under each tip [deg]."""
        return tuple(scene_of(self.design).slopes_deg)


def level_sensor(sensor: PressedSensor) -> LevelSensor:
    """Return the level pair that stands for a sensor."""
    pair = sensor.pair
    return LevelSensor(
        design=pair.design,
        contact=pair.contact,
        sizing=pair.sizing,
        springs=pair.springs,
        characteristic=characteristic(pair.contact, pair.sizing, pair.springs.stiffnesses, pair.springs.errors),
    )


def effects_on(sensor: LevelSensor, travel: Floats | float, deflections: Floats) -> tuple[Effect, ...]:
    """Return all effects at travels [mm] where the springs deflect that far [mm], shape (2, ...)."""
    travel = np.maximum(LEAST_TRAVEL, travel)
    depths = travel - deflections
    return (
        *_large_deflection(sensor, deflections),
        *sensor.effects_of_housing,
        *_left_out_of_contact(sensor, depths),
        *_left_out_of_motion(sensor, travel, deflections),
        *sensor.scatter_of_prints,
        *_scatter_of_tips(sensor, depths),
        *sensor.scatter_of_scenes,
    )


def effects_after_calibration(effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """Return the effects that calibrating a unit leaves: those it does not touch, and its own errors.

    Each stiffness is then known to 1 %, and the tips are zeroed on a flat plate.
    """
    known = f"known to {100.0 * CALIBRATED:g} %"
    zeroed = f"tips zeroed on a flat plate to {ZEROED_MM:g} mm"
    half = 0.5 * ZEROED_MM
    return (
        *(effect for effect in effects if not effect.calibrated),
        Effect(name="low spring", reason=known, springs=np.array([CALIBRATED, 0.0]), scatters=True),
        Effect(name="high spring", reason=known, springs=np.array([0.0, CALIBRATED]), scatters=True),
        Effect(name="tip height", reason=zeroed, height_offsets=np.array([-half, half]), scatters=True),
    )


def _large_deflection(sensor: LevelSensor, deflections: Floats) -> Iterator[Effect]:
    """Yield the effect of the large deflection of leaves, which stiffens them; none where no housing is made."""
    housing = sensor.springs.housing
    if housing is None:
        return
    leaves = [arm.flexure for arm in housing.arms]
    bent = " and ".join(f"{deflection.max():.3g}" for deflection in deflections)
    stiffer = np.array([stiffening(leaf, deflection) for leaf, deflection in zip(leaves, deflections, strict=True)])
    yield Effect(name="large deflection", reason=f"elastica of leaves bent by {bent} mm", springs=stiffer)


def _left_out_of_housing(sensor: LevelSensor) -> Iterator[Effect]:
    """Yield the effects that the model leaves out of springs that are made, but for their large deflection."""
    housing = sensor.springs.housing
    if housing is None:
        return
    process = sensor.springs.process
    leaves = [arm.flexure for arm in housing.arms]

    marked = []
    for leaf, fraction, K in zip(leaves, FRAME_FRACTIONS, sensor.characteristic.springs.stiffnesses, strict=True):
        of_frame = fraction * K / (process.E_MPa * leaf.depth)  # fraction of 1/K [1], which grows as the depth falls
        marked.append(-of_frame * ENGRAVED_MM / (leaf.depth - ENGRAVED_MM))
    reason = f"at most: the whole frame thinner by the {ENGRAVED_MM:g} mm that the marks are deep"
    yield Effect(name="engraved marks", reason=reason, springs=np.array(marked), calibrated=True)

    if process.line_width_mm is not None:  # the first layer of lines spreads
        footed = []
        for leaf in leaves:
            thicker = (leaf.thickness + 2.0 * FOOT_MM) / leaf.thickness
            footed.append(FOOT_HIGH_MM / leaf.depth * (thicker**BEAM_SLOPE - 1.0))
        reason = f"a first layer {FOOT_MM:g} mm wider on each side, {FOOT_HIGH_MM:g} mm high; cut it off or calibrate"
        yield Effect(name="elephant's foot", reason=reason, springs=np.array(footed), calibrated=True)

    yield _other_mount()
    yield from _creep(sensor)


def _creep(sensor: LevelSensor) -> Iterator[Effect]:
    """Yield the effect of creep: springs are stiffer in a press than under a weight that hangs, by which K is known.

    A reading corrects it, and its sources hold what that leaves.
    """
    creep = sensor.springs.creep
    if creep.exponent == 0.0 or sensor.design.reading is not None:
        return
    press_s = sensor.design.press_s
    stiffer = creep.press_over_weighed(WEIGHED_AFTER_S, press_s) - 1.0
    reason = (
        f"in a press of {press_s:.3g} s, against a weight read after {WEIGHED_AFTER_S:g} s; the compliance grows by "
        f"{100.0 * creep.per_decade:.2g} % a decade"
    )
    yield Effect(name="creep", reason=reason, springs=np.array([stiffer, stiffer]))


def _other_mount() -> Effect:
    """Return the bound on what another mount changes."""
    percents = " and ".join(f"{100.0 * abs(change):.2g}" for change in LARGEST_MOUNT_CHANGES)
    reason = (
        f"another mount than the sheet's: at most {percents} % over presets, processes and mounts "
        "(docs/measurements.md)"
    )
    return Effect(name="mount", reason=reason, springs=np.array(LARGEST_MOUNT_CHANGES), calibrated=True)


def _left_out_of_contact(sensor: LevelSensor, depths: Floats) -> Iterator[Effect]:
    """Yield the effects that the model leaves out of the fruit under tips at their depths in it [mm]."""
    design = sensor.design
    poisson = design.fruit.poisson
    stiffer = no_slip(poisson)
    reason = "the tip slides on the skin; more where it does not, as a circle on a half-space (Spence 1968)"
    yield Effect(name="no slip", reason=reason, fruit=np.array([stiffer, stiffer]))

    sides_deep = depths / design.tips.side_mm
    reason = f"FE of one tip, at most {sides_deep.max():.2g} tip sides deep"
    yield Effect(name="large strain", reason=reason, fruit=large_strain_factor(sides_deep, poisson) - 1.0)
    reason = f"{reason}; Hencky and foam apart, with neo-Hooke between"
    yield Effect(name="law of the flesh", reason=reason, fruit=constitutive_spread(sides_deep, poisson))

    slopes = sensor.slopes_deg
    sliding = np.array([frictionless_press(poisson, math.tan(math.radians(angle))) for angle in slopes])
    reason = f"a tip that slides on a skin falling by {max(map(abs, slopes)):.2g} deg presses along its normal"
    yield Effect(name="slope", reason=reason, fruit=sliding)


def _left_out_of_motion(sensor: LevelSensor, travel: Floats, deflections: Floats) -> Iterator[Effect]:
    """Yield the effects of sideways motion at travels [mm]: flat tips on a slope, and a whole fruit that lies free."""
    if not sensor.design.tips.tip_shape.obeys_hertz:  # the law of domes counts their sideways give itself
        yield from _sideways_give(sensor, travel, deflections)
    yield from _free_fruit(sensor, travel)


def _sideways_give(sensor: LevelSensor, travel: Floats, deflections: Floats) -> Iterator[Effect]:
    """Yield the effect of forces that lean on flat tips, which move sideways and so along a sloped skin.

    The spring then gives more along the press, which counts as if the fruit under its tip were softer.
    """
    sideways = sensor.springs.sideways
    if sideways is None:
        return
    slopes = sensor.slopes_deg
    softer = []
    for tip, deflection in enumerate(deflections):
        lean = np.array([math.tan(math.radians(slopes[tip])), 0.0, 1.0])  # of the force, over its part along the press
        more = float(lean @ sideways.compliance[tip, tip] @ lean / sensor.springs.C[tip, tip])
        depth = np.maximum(LEAST_TRAVEL, travel - deflection)
        softer.append(1.0 / (1.0 + more * deflection / depth) - 1.0)
    reason = f"a force that leans by {max(map(abs, slopes)):.2g} deg moves a tip sideways too"
    yield Effect(name="sideways give", reason=reason, fruit=np.array(softer))


def _free_fruit(sensor: LevelSensor, travel: Floats) -> Iterator[Effect]:
    """Yield the effect of a whole fruit that lies free on a table: it rolls, and tips stand higher or lower over it."""
    fruit = sensor.design.fruit
    if not fruit.can_roll or fruit.radius_mm is None:
        return
    tips = sensor.design.tips
    law = sensor.characteristic
    stiffness = [
        series_stiffness(law.springs.K_l, law.K_m_max),
        series_stiffness(law.springs.K_h, law.stiffness_ratio * law.K_m_max),
    ]
    turns = []
    for each in travel.flat:
        rolled = roll([K * each for K in stiffness], tips.centres_mm, stiffness, fruit.radius_mm)
        # A fruit that runs away takes a tip off: one more travel than there is.
        turns.append(math.radians(rolled.angle_deg) if rolled.steady else 2.0 * each / tips.spacing_mm)
    # The coefficient of friction in words is the same at all travels, as all forces are proportional to them.
    offsets = np.multiply.outer(tips.centres_mm, np.reshape(turns, travel.shape))
    reason = f"a fruit that lies free on a table rolls, unless friction holds it: {rolled.friction:.2g} is enough"
    yield Effect(name="free fruit", reason=reason, height_offsets=offsets)


def _scatter_of_prints(sensor: LevelSensor) -> Iterator[Effect]:
    """Yield the scatter of prints, the same for all springs as they are one print."""
    process = sensor.springs.process
    E = COVERAGE * process.E_scatter
    reason = f"E of {process.name} within {100.0 * E:g} % from print to print"
    yield Effect(name="modulus", reason=reason, springs=np.array([E, E]), scatters=True, calibrated=True)

    off = process.accuracy_mm  # which holds 95 % already
    thicker = np.array([((t + off) / t) ** BEAM_SLOPE - 1.0 for t in process.leaf_thicknesses_mm])
    reason = f"leaves {off:g} mm off; K goes with t to the {BEAM_SLOPE:g}"
    yield Effect(name="leaf thickness", reason=reason, springs=thicker, scatters=True, calibrated=True)


def _scatter_of_tips(sensor: LevelSensor, depths: Floats) -> Iterator[Effect]:
    """Yield the scatter of tips as they are made: side, edge, which acts at depths in the fruit [mm], and height."""
    side = sensor.design.tips.side_mm
    off = tip_accuracy_mm(sensor.design.tips, sensor.springs.process)
    wider = min(LARGEST_CHANGE, off / side)
    reason = f"tips {off:g} mm off; the fruit's goes with the side"
    yield Effect(name="tip side", reason=reason, fruit=np.array([wider, wider]), scatters=True)

    reason = f"edges rounded by {off:g} mm, at the depth of each tip"
    yield Effect(name="tip edge", reason=reason, fruit=-edge_loss(depths, side, off), scatters=True)

    apart = np.array([-0.5 * off, 0.5 * off])  # up for one tip, down for the other
    reason = f"{off:g} mm between the tips; zero the tips on a flat plate"
    yield Effect(name="tip height", reason=reason, height_offsets=apart, scatters=True, calibrated=True)


def _scatter_of_scenes(sensor: LevelSensor) -> Iterator[Effect]:
    """Yield the scatter of fruit and press: Poisson's ratio, tilt, and the attitude of the sensor."""
    design = sensor.design
    fruit = design.fruit
    largest = min(INCOMPRESSIBLE, abs(fruit.poisson) + fruit.poisson_spread)
    change = (1.0 - fruit.poisson**2) / (1.0 - largest**2) - 1.0
    reason = f"within {fruit.poisson_spread:g}; the fruit's goes with 1 / (1 - nu^2), as on a half-space"
    yield Effect(name="Poisson's ratio", reason=reason, fruit=np.array([change, change]), scatters=True)

    degrees = design.press.tilt_spread_deg
    step = 0.5 * design.tips.spacing_mm * math.tan(math.radians(degrees))
    reason = f"the sensor tilted by {degrees:g} deg"
    yield Effect(name="pose", reason=reason, height_offsets=np.array([-step, step]), scatters=True)

    offsets = tip_height_offsets(sensor.springs, "down") if design.press.attitude == "side" else ()
    if offsets:
        apart = max(offsets) - min(offsets)
        reason = (
            f"pressed down, not sideways, its tips stand {apart:.2g} mm off level: see press.attitude, or zero them"
        )
        yield Effect(name="weight", reason=reason, height_offsets=np.array(offsets), scatters=True, calibrated=True)
