"""Causes of errors in the results of a sensor, other than the numerical error.

A cause is either an effect that the model leaves out, or the scatter of an input (two standard deviations). A cause
changes the stiffness of a spring, the stiffness of the fruit under a tip, or the height of a tip. `budget.py`
propagates each cause to each result. The advice of a cause becomes a note.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from cad.parts.housing import ENGRAVED_MM
from cad.parts.pin import tip_accuracy_mm
from pipeline.errors.targets import LEAST_TRAVEL, force_ratio_curve
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import scene_of
from pipeline.springs.behaviour import stiffening
from pipeline.springs.fitted_springs import tip_height_offsets
from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.processes import FOOT_MM, Process
from sensor.design.reading import WEIGHED_AFTER_S
from sensor.quantity import COVERAGE
from sensor.theory.free_fruit import roll
from sensor.theory.leaf_spring import Flexure
from sensor.theory.rounded_edge import edge_loss
from sensor.theory.sloped_skin import frictionless_stiffness_change
from sensor.theory.soft_tissue import (
    LARGEST_CHANGE,
    constitutive_spread,
    large_strain_factor,
    largest_solved_depth,
    no_slip_stiffness_change,
)
from sensor.theory.two_spring_law import series_stiffness

BEAM_SLOPE = 3.0  # d ln K / d ln t of a beam of thickness t; the slope of solid leaves is smaller, so 3 is a bound
INCOMPRESSIBLE = 0.5  # Poisson's ratio of incompressible flesh
FOOT_HIGH_MM = 0.2  # height of the first layer [mm], which is wider than the other layers by FOOT_MM on each side
# Fraction of the compliance 1/K that is due to the frame, times E w / K, for the low and the high spring. Here w is the
# depth of the leaves. The fraction is 0.08 % for K = 0.753 N/mm and 0.6 % for K = 17.3 N/mm, at E = 2000 MPa with
# w = 6 mm. These values hold for plastic leaves. With long steel leaves the frame contributes 6 to 7 times as much,
# which is 0.005 % and 0.04 %. See tests/reference/fits/test_housing.py.
FRAME_FRACTIONS = (0.0008 * 12000.0 / 0.753, 0.006 * 12000.0 / 17.3)
# Largest relative change of the low and of the high spring due to another mount, with a margin of a quarter. The values
# cover all presets, processes and mounts: docs/measurements.md#other-mounts. The low spring becomes softer and the high
# spring stiffer, because this changes P most.
LARGEST_MOUNT_CHANGES = (-0.0011, 0.0086)
POSE = "pose"  # name of the cause whose effect is solved in tilted scenes
CALIBRATED = 0.01  # relative error of each stiffness after the calibration of a printed unit with weights
ZEROED_MM = 0.01  # height difference of two tips after zeroing on a flat plate [mm], by judgement


@dataclass(frozen=True, kw_only=True, eq=False)
class Cause:
    """An effect on the results of a sensor.

    `springs` and `fruit` [1] are the relative changes of the stiffness of each spring, and of the fruit under each tip.
    `height_offsets` [mm] are the changes of the height of each tip. All three have one row per tip. Their shape is (2,)
    if they are the same in all presses, and otherwise (2, ...) with the shape of the presses.

    `scatters` is true for an input that is known within a range, which acts in both directions. All other causes are
    effects that the model leaves out. A `calibrated` cause vanishes when the printed unit is calibrated. The stiffness
    of a spring is proportional to its input to the `power`. `advice` is an action for the user. A note with advice uses
    the reason as its subject, so the reason is then a noun phrase.
    """

    name: str
    reason: str
    springs: Floats = field(default_factory=lambda: np.zeros(2))
    fruit: Floats = field(default_factory=lambda: np.zeros(2))
    height_offsets: Floats = field(default_factory=lambda: np.zeros(2))
    scatters: bool = False
    calibrated: bool = False
    power: float = 1.0
    advice: str = ""


NO_CAUSE = Cause(name="", reason="")


def all_causes(pair: PressedSensor, travel: Floats | float, deflections: Floats) -> tuple[Cause, ...]:
    """Return all causes of error of a pair of tips, each with its size in the presses to these travels.

    `travel` [mm] has any shape. `deflections` (2, ...) [mm] are the deflections of the low and the high spring at these
    travels. The effects that the model leaves out come first. The scatter of the inputs follows.
    """
    travel = np.maximum(LEAST_TRAVEL, travel)  # relative changes are not defined at a travel of 0
    depths = travel - deflections  # indentations of the fruit under both tips (2, ...) [mm]
    return (
        *_housing_effects(pair, deflections),
        *_contact_effects(pair.design, depths),
        *_motion_effects(pair, travel, deflections),
        *_print_scatter(pair.springs.process),
        *_tip_scatter(pair, depths),
        *_scene_scatter(pair),
    )


def after_calibration(causes: Iterable[Cause]) -> tuple[Cause, ...]:
    """Return the causes that remain after the calibration of a printed unit, and the errors of the calibration itself.

    Weights determine both stiffnesses, and zeroing on a flat plate determines the heights of the tips. The weights and
    the zeroing have small errors, which are added as causes.
    """
    reason = f"tips zeroed on a flat plate to {ZEROED_MM:g} mm"
    half_step = 0.5 * ZEROED_MM  # one tip is lower by half of the difference, the other is higher
    return (
        *(cause for cause in causes if not cause.calibrated),
        *known_springs(),
        Cause(name="tip height", reason=reason, height_offsets=np.array([-half_step, half_step]), scatters=True),
    )


def known_springs() -> tuple[Cause, ...]:
    """Return the stiffness errors of the two springs of a calibrated unit, as independent causes.

    Each spring is calibrated separately, so each cause changes only one entry of `springs`: low, then high.
    """
    reason = f"known to {100.0 * CALIBRATED:g} %"
    return (
        Cause(name="low spring", reason=reason, springs=np.array([CALIBRATED, 0.0]), scatters=True),
        Cause(name="high spring", reason=reason, springs=np.array([0.0, CALIBRATED]), scatters=True),
    )


def _housing_effects(pair: PressedSensor, deflections: Floats) -> Iterator[Cause]:
    """Yield the effects that change the stiffness of printed springs and that the model leaves out.

    `deflections` (2, ...) [mm] are the deflections of the low and the high spring. A sensor without a housing has no
    printed springs, so nothing is yielded.
    """
    housing = pair.springs.housing
    if housing is None:
        return
    process = pair.springs.process
    leaves = [arm.flexure for arm in housing.arms]
    yield _large_deflection(leaves, deflections)
    yield _engraved_marks(leaves, pair)
    if process.line_width_mm is not None:  # only a process that prints lines has a first layer that spreads
        yield _elephants_foot(leaves)
    yield _different_mount()
    # A design with readings corrects the creep, and its readings contain the error of this correction.
    if pair.springs.creep.exponent != 0.0 and pair.design.reading is None:
        yield _creep_in_press(pair)


def _large_deflection(leaves: Sequence[Flexure], deflections: Floats) -> Cause:
    """Return the stiffening of the leaves at their deflections (2, ...) [mm], according to the elastica.

    The model of a run is linear, so it leaves out that a leaf becomes stiffer as it bends.
    """
    deflections_text = " and ".join(f"{deflection.max():.3g}" for deflection in deflections)
    changes = np.array([stiffening(leaf, deflection) for leaf, deflection in zip(leaves, deflections, strict=True)])
    return Cause(name="large deflection", reason=f"elastica of leaves bent by {deflections_text} mm", springs=changes)


def _engraved_marks(leaves: Sequence[Flexure], pair: PressedSensor) -> Cause:
    """Return an upper bound for the softening by engraved marks, which the meshed housing does not have.

    The bound assumes that the whole frame is thinner by the depth of the marks.
    """
    mark_changes = []
    # a scaled fraction is the frame's fraction of the compliance 1/K, times E w / K with the depth w of the leaves
    for leaf, scaled_fraction, K in zip(leaves, FRAME_FRACTIONS, pair.springs.stiffnesses.stiffnesses, strict=True):
        # A frame that is thinner by the depth of the marks is softer by the relative change of its depth.
        frame_fraction = scaled_fraction * K / (pair.springs.process.E_MPa * leaf.depth)
        mark_changes.append(-frame_fraction * ENGRAVED_MM / (leaf.depth - ENGRAVED_MM))
    reason = f"at most: the whole frame thinner by the {ENGRAVED_MM:g} mm that the marks are deep"
    return Cause(name="engraved marks", reason=reason, springs=np.array(mark_changes), calibrated=True)


def _elephants_foot(leaves: Sequence[Flexure]) -> Cause:
    """Return the stiffening of the leaves by their first layer, which is wider than the other layers.

    The plate is printed flat on the bed, so the first layer is one edge of each leaf.
    """
    foot_changes = []
    for leaf in leaves:
        # K is proportional to the cube of the thickness. Only the first layer is thicker, so the change is multiplied
        # by its fraction of the depth.
        thickness_ratio = (leaf.thickness + 2.0 * FOOT_MM) / leaf.thickness
        foot_changes.append(FOOT_HIGH_MM / leaf.depth * (thickness_ratio**BEAM_SLOPE - 1.0))
    return Cause(
        name="elephant's foot",
        reason=f"a first layer {FOOT_MM:g} mm wider on each side and {FOOT_HIGH_MM:g} mm high",
        springs=np.array(foot_changes),
        calibrated=True,
        advice="Cut off the elephant's foot, or calibrate",
    )


def _different_mount() -> Cause:
    """Return the largest effect of a mount that differs from the mount of the fabrication sheet.

    A run solves only the mount of the sheet. The largest effects come from a study of other mounts.
    """
    percents = " and ".join(f"{100.0 * abs(change):.2g}" for change in LARGEST_MOUNT_CHANGES)
    reason = (
        f"another mount than the sheet's: at most {percents} % over presets, processes and mounts "
        "(docs/measurements.md)"
    )
    return Cause(name="mount", reason=reason, springs=np.array(LARGEST_MOUNT_CHANGES), calibrated=True)


def _creep_in_press(pair: PressedSensor) -> Cause:
    """Return the effect of creep: plastic springs are stiffer in a short press than under a hanging weight.

    The stiffness of a unit is calibrated with weights, which are read after `WEIGHED_AFTER_S`.
    """
    creep = pair.springs.creep
    press_s = pair.design.press_s
    stiffness_increase = creep.press_stiffness_ratio(WEIGHED_AFTER_S, press_s) - 1.0  # relative to the stiffness [1]
    reason = (
        f"in a press of {press_s:.3g} s, against a weight read after {WEIGHED_AFTER_S:g} s; the compliance grows "
        f"by {100.0 * creep.per_decade:.2g} % a decade"
    )
    return Cause(name="creep", reason=reason, springs=np.full(2, stiffness_increase))


def _contact_effects(design: Design, depths: Floats) -> Iterator[Cause]:
    """Yield the effects on the fruit that the model leaves out: friction, large strain, and sliding on sloped skin.

    `depths` (2, ...) [mm] are the indentations of the fruit under the tips.
    """
    poisson = design.fruit.poisson
    grip_change = no_slip_stiffness_change(poisson)  # relative change of the fruit stiffness if the tip does not slide
    reason = "the tip slides on the skin; more where it does not, as a circle on a half-space (Spence 1968)"
    yield Cause(name="no slip", reason=reason, fruit=np.array([grip_change, grip_change]))

    yield from _large_strain_effects(design, depths)

    slopes = scene_of(design).slopes_deg  # slope of the skin under each tip
    sliding = np.array([frictionless_stiffness_change(poisson, math.tan(math.radians(angle))) for angle in slopes])
    reason = f"a tip that slides on a skin falling by {max(map(abs, slopes)):.2g} deg presses along its normal"
    yield Cause(name="slope", reason=reason, fruit=sliding)


def _large_strain_effects(design: Design, depths: Floats) -> Iterator[Cause]:
    """Yield the effects of large strain and of the constitutive law of the flesh on the stiffness of the fruit.

    `depths` (2, ...) [mm] are the indentations of the fruit under the tips.
    """
    poisson = design.fruit.poisson
    depths_in_sides = depths / design.tips.side_mm  # the tabulated solutions are for depths relative to the tip side
    deepest = float(depths_in_sides.max())
    # The tabulated solutions cover only flat faces, up to a certain depth. Otherwise the user has to check the sensor.
    is_covered = design.tips.tip_shape.has_flat_face and deepest <= largest_solved_depth()
    advice = "Calibrate at full travel" if is_covered else "Check the deepest press on a body of known modulus"
    method = f"(FE of one tip, at most {deepest:.2g} tip sides deep)"
    yield Cause(
        name="large strain",
        reason=f"large strain {method}",
        fruit=large_strain_factor(depths_in_sides, poisson) - 1.0,
        advice=advice,
    )
    yield Cause(
        name="law of the flesh",
        reason=f"the law of the flesh, Hencky's or foam {method}",
        fruit=constitutive_spread(depths_in_sides, poisson),
        advice=advice,
    )


def _motion_effects(pair: PressedSensor, travel: Floats, deflections: Floats) -> Iterator[Cause]:
    """Yield the effects of lateral motion that the model leaves out: flat tips that slide, and a fruit that rolls.

    `travel` [mm] has any shape, and `deflections` (2, ...) [mm] are the deflections of the springs at these travels.
    """
    design = pair.design
    sideways = pair.springs.sideways
    if sideways is not None and not design.tips.tip_shape.obeys_hertz:  # the law of domes includes this effect
        yield _sideways_give(pair, sideways.compliance, travel, deflections)
    radius = design.fruit.radius_mm
    if design.fruit.can_roll and radius is not None:
        yield _free_fruit(pair, radius, travel)


def _sideways_give(pair: PressedSensor, compliance: Floats, travel: Floats, deflections: Floats) -> Cause:
    """Return the effect of the sideways compliance of the springs under forces that the skin inclines.

    A force along the normal of the skin also pushes its tip down the slope. The motion down the slope adds to the
    compliance of the spring. Here the addition is expressed as a softer fruit, because the springs keep their
    stiffness.

    `compliance` (tips, tips, 3, 3) [mm/N] is the `LateralCompliance` of the tips. Its last two axes are the directions
    x along the tips, y across them, and z along the press. The entries for motion along z under forces along z are 0,
    because the compliance of the springs contains them. `travel` [mm] has any shape, and `deflections` (2, ...) [mm]
    are the deflections of the springs at these travels.
    """
    slopes = scene_of(pair.design).slopes_deg  # along x, the line of the tips
    fruit_changes = []
    for tip, deflection in enumerate(deflections):
        # the inclined force divided by its component along the press, as a vector (x, y, z)
        inclination = np.array([math.tan(math.radians(slopes[tip])), 0.0, 1.0])
        added_fraction = float(inclination @ compliance[tip, tip] @ inclination / pair.C[tip, tip])
        # Under the same force, the displacement `added_fraction` times the deflection adds to the indentation.
        depth = np.maximum(LEAST_TRAVEL, travel - deflection)
        fruit_changes.append(1.0 / (1.0 + added_fraction * deflection / depth) - 1.0)
    reason = f"a force that leans by {max(map(abs, slopes)):.2g} deg moves a tip sideways too"
    return Cause(name="sideways give", reason=reason, fruit=np.array(fruit_changes))


def _free_fruit(pair: PressedSensor, radius: float, travel: Floats) -> Cause:
    """Return the effect of a fruit of `radius` [mm] that rolls on a table without friction, as offsets of the tips.

    `travel` [mm] has any shape. The fruit rolls about its point of support, so the offset of a tip is the angle of roll
    times its distance from the apex. The model of a run holds the fruit.
    """
    design = pair.design
    positions = design.tips.centres_mm  # positions of the tips relative to the apex [mm]
    law = force_ratio_curve(pair)
    # stiffness of each spring in series with the firmest fruit, low then high [N/mm]
    series_stiffnesses = [
        series_stiffness(law.springs.K_l, law.K_m_max),
        series_stiffness(law.springs.K_h, law.stiffness_ratio * law.K_m_max),
    ]
    roll_angles = []  # [rad]
    for one_travel in travel.flat:
        forces = [K * one_travel for K in series_stiffnesses]
        rolled = roll(forces, positions, series_stiffnesses, radius)
        if rolled.steady:
            roll_angles.append(math.radians(rolled.angle_deg))
        else:
            # The fruit rolls away. The angle is chosen so large that a tip certainly lifts off: the offsets of the two
            # tips differ by twice the travel.
            roll_angles.append(2.0 * one_travel / design.tips.spacing_mm)
    # Forces are proportional to the travel, so the coefficient of friction of the last travel holds for all travels.
    return Cause(
        name="free fruit",
        reason=f"a fruit that rolls freely on a table (friction of {rolled.friction:.2g} holds it)",
        height_offsets=np.multiply.outer(positions, np.reshape(roll_angles, travel.shape)),
        advice="Hold the fruit",
    )


def _print_scatter(process: Process) -> Iterator[Cause]:
    """Yield the scatter of modulus and leaf thickness from print to print.

    All springs of a print share the deviation of each input from its nominal value.
    """
    advice = "Calibrate each printed unit"
    E_change = COVERAGE * process.E_scatter  # two standard deviations [1]; K is proportional to E
    yield Cause(
        name="modulus",
        reason=f"E of {process.name} within {100.0 * E_change:g} % from print to print",
        springs=np.array([E_change, E_change]),
        scatters=True,
        calibrated=True,
        advice=advice,
    )
    accuracy = process.accuracy_mm  # half width of the 95 % interval [mm]
    stiffness_changes = np.array([((t + accuracy) / t) ** BEAM_SLOPE - 1.0 for t in process.leaf_thicknesses_mm])
    yield Cause(
        name="leaf thickness",
        reason=f"leaf thickness within {accuracy:g} mm (K as t^{BEAM_SLOPE:g})",
        springs=stiffness_changes,
        scatters=True,
        calibrated=True,
        power=BEAM_SLOPE,
        advice=advice,
    )


def _tip_scatter(pair: PressedSensor, depths: Floats) -> Iterator[Cause]:
    """Yield the scatter of the tips: their sides, the rounding of their edges, and their heights.

    The effect of the rounding depends on the depth of the tips: `depths` (2, ...) [mm] are the indentations of the
    fruit under them.
    """
    tips = pair.design.tips
    accuracy = tip_accuracy_mm(tips, pair.springs.process)  # two standard deviations [mm]
    # The formulas for relative changes hold only up to LARGEST_CHANGE, so a larger error of the side is limited to it.
    side_change = min(LARGEST_CHANGE, accuracy / tips.side_mm)
    reason = f"tips wider or narrower by {accuracy:g} mm (the fruit's stiffness is proportional to the side)"
    yield Cause(name="tip side", reason=reason, fruit=np.array([side_change, side_change]), scatters=True)

    reason = f"edges rounded by {accuracy:g} mm, at the depth of each tip"
    yield Cause(name="tip edge", reason=reason, fruit=-edge_loss(depths, tips.side_mm, accuracy), scatters=True)

    heights = np.array([-0.5 * accuracy, 0.5 * accuracy])  # one tip is lower, the other is higher
    yield Cause(
        name="tip height",
        reason=f"a step of {accuracy:g} mm between the tips",
        height_offsets=heights,
        scatters=True,
        calibrated=True,
        advice=zeroing(pair.design),
    )


def _scene_scatter(pair: PressedSensor) -> Iterator[Cause]:
    """Yield the scatter of the scene: Poisson's ratio of the fruit, and the tilt and the attitude of the sensor."""
    design = pair.design
    yield _unknown_poisson(design.fruit)

    degrees = design.press.tilt_spread_deg
    # A tilt about the middle of the sensor lowers one tip by this step [mm] and raises the other one by it.
    step = 0.5 * design.tips.spacing_mm * math.tan(math.radians(degrees))
    yield Cause(
        name=POSE,
        reason=f"a tilt of {degrees:g} deg more or less",
        height_offsets=np.array([-step, step]),
        scatters=True,
        advice="Hold the sensor steady",
    )

    # A sensor that is designed to press sideways may also be pressed down. The weight of its moving parts then bends
    # the springs and moves its tips out of level. Empty offsets mean that the tips stay level.
    offsets = tip_height_offsets(pair.springs, "down") if design.press.attitude == "side" else ()
    if offsets:
        difference = max(offsets) - min(offsets)
        yield Cause(
            name="weight",
            reason=f"pressing down instead of sideways (tips {difference:.2g} mm off level)",
            height_offsets=np.array(offsets),
            scatters=True,
            calibrated=True,
            advice=zeroing(design),
        )


def _unknown_poisson(fruit: Fruit) -> Cause:
    """Return the scatter of the stiffness of a fruit whose Poisson's ratio nu is known only within a range."""
    # On a half-space, the stiffness is proportional to 1 / (1 - nu^2), so only the magnitude of nu matters. The
    # stiffness changes most at the upper end of the range of nu, which is at most the value of incompressible flesh.
    largest_poisson = min(INCOMPRESSIBLE, abs(fruit.poisson) + fruit.poisson_spread)
    stiffness_change = (1.0 - fruit.poisson**2) / (1.0 - largest_poisson**2) - 1.0
    return Cause(
        name="Poisson's ratio",
        reason=f"Poisson's ratio nu within {fruit.poisson_spread:g} (as 1 / (1 - nu^2), as on a half-space)",
        fruit=np.array([stiffness_change, stiffness_change]),
        scatters=True,
        advice="Set fruit.poisson if it is known",
    )


def zeroing(design: Design) -> str:
    """Return the advice for tips that are not level."""
    return f"Zero the tips on a flat plate in the attitude of the press ({design.press.attitude})"
