"""What moves the fruit and the travel of each tip: its flesh, the shape of the tips, pose, weight and table."""

import math
from collections.abc import Sequence

from cad.design.parameters import Design
from cad.theory.free_fruit import Roll, roll
from cad.theory.rounded_edge import edge_loss
from cad.theory.sloped_skin import frictionless_press
from cad.theory.soft_tissue import LARGEST_CHANGE, constitutive_spread, large_strain_factor, no_slip
from cad.theory.two_spring_law import series_stiffness
from pipeline.response.scene_press import scene_of
from pipeline.springs.fitted_springs import tip_height_offsets
from pipeline.verdicts.errors.cause import LEAST_TRAVEL, Cause, Sensor

INCOMPRESSIBLE = 0.5  # Poisson's ratio


def flesh_effects(design: Design, travel: float, gives: Sequence[float]) -> tuple[Cause, ...]:
    """Return what the contact leaves out: grip between tip and skin, large strain, other laws of the flesh."""
    poisson, travel = design.fruit.poisson, max(LEAST_TRAVEL, travel)
    depths = [(travel - give) / design.tips.side_mm for give in gives]
    grip = "the tip slides on the skin; more where it does not, as a circle on a half-space (Spence 1968)"
    deep = f"FE of one tip, {max(depths):.2g} tip sides deep"
    stiffer = no_slip(poisson)
    strained = tuple(large_strain_factor(depth, poisson) - 1.0 for depth in depths)
    spread = tuple(constitutive_spread(depth, poisson) for depth in depths)
    apart = f"{deep}; Hencky and foam apart, with neo-Hooke between"
    linear = design.press.strain == "linear"
    return (
        Cause(effect="no slip", reason=grip, fruit=(stiffer, stiffer)),
        *([Cause(effect="large strain", reason=deep, fruit=strained)] if linear else []),
        Cause(effect="law of the flesh", reason=apart, fruit=spread),
    )


def skin_effects(sensor: Sensor, travel: float) -> tuple[Cause, ...]:
    """Return what a sloping skin under the tips leaves out, and a whole fruit that lies free on a table."""
    design = sensor.design
    angles = scene_of(design).slopes_deg
    sliding = tuple(frictionless_press(design.fruit.poisson, math.tan(math.radians(angle))) for angle in angles)
    steepest = max(map(abs, angles))
    reason = f"a tip that slides on a skin falling by {steepest:.2g} deg presses along its normal"
    slope = Cause(effect="slope", reason=reason, fruit=sliding)
    rolled = free_roll(sensor, travel)
    if rolled is None:
        return (slope,)
    # A fruit that runs away takes a tip off: one more travel than there is.
    turn = math.radians(rolled.angle_deg) if rolled.steady else 2.0 * travel / design.tips.spacing_mm
    lead = tuple(turn * place for place in design.tips.centres_mm)
    reason = f"a fruit that lies free on a table rolls, unless friction holds it: {rolled.friction:.2g} is enough"
    return slope, Cause(effect="free fruit", reason=reason, lead=lead)


def free_roll(sensor: Sensor, travel: float) -> Roll | None:
    """Return how the tips roll a whole fruit that lies free, at E_max and a travel [mm]; None for a part of one."""
    fruit, own = sensor.design.fruit, sensor.own
    if fruit.radius_mm is None or not fruit.whole or fruit.depth_mm <= fruit.radius_mm:
        return None
    under = (own.K_m_max, own.stiffness_ratio * own.K_m_max)
    stiffness = [series_stiffness(K, K_m) for K, K_m in zip(own.springs.stiffnesses, under, strict=True)]
    forces = [K * travel for K in stiffness]
    return roll(forces, sensor.design.tips.centres_mm, stiffness, fruit.radius_mm)


def tip_scatter(design: Design, off: float, travel: float, gives: Sequence[float]) -> tuple[Cause, ...]:
    """Return what tips that are off by a length [mm] in side, edge and height do."""
    side, travel = design.tips.side_mm, max(LEAST_TRAVEL, travel)
    softer = tuple(-edge_loss(travel - give, side, off) for give in gives)
    wider = min(LARGEST_CHANGE, off / side)
    half = 0.5 * off
    flat = "zero the tips on a flat plate"
    return (
        Cause(effect="tip side", reason=f"tips {off:g} mm off; the fruit's goes with the side", fruit=(wider, wider)),
        Cause(effect="tip edge", reason=f"edges rounded by {off:g} mm, at the depth of each tip", fruit=softer),
        Cause(effect="tip height", reason=f"{off:g} mm between the tips; {flat}", lead=(-half, half), calibrated=True),
    )


def fruit_and_pose(sensor: Sensor) -> tuple[Cause, ...]:
    """Return what the spread of Poisson's ratio does to the fruit, and tilt and weight to the travel of each tip."""
    design = sensor.design
    fruit, degrees = design.fruit, design.press.tilt_spread_deg
    softer = min(INCOMPRESSIBLE, abs(fruit.poisson) + fruit.poisson_spread)
    change = (1.0 - fruit.poisson**2) / (1.0 - softer**2) - 1.0
    step = 0.5 * design.tips.spacing_mm * math.tan(math.radians(degrees))
    ratio = f"within {fruit.poisson_spread:g}; the fruit's goes with 1 / (1 - nu^2), as on a half-space"
    return (
        Cause(effect="Poisson's ratio", reason=ratio, fruit=(change, change)),
        Cause(effect="pose", reason=f"the sensor tilted by {degrees:g} deg", lead=(-step, step)),
        *_weight(sensor),
    )


def _weight(sensor: Sensor) -> tuple[Cause, ...]:
    """Return what the weight of the moving parts does to a sensor that is held sideways when it presses down."""
    leads = tip_height_offsets(sensor.springs, "down") if sensor.design.press.attitude == "side" else ()
    if not leads:
        return ()
    apart = max(leads) - min(leads)
    reason = f"pressed down, not sideways, its tips stand {apart:.2g} mm off level; see press.attitude, or zero them so"
    return (Cause(effect="weight", reason=reason, lead=leads, calibrated=True),)
