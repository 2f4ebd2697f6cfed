"""Whether the tips that are made are those of the response, and whether their faces hold the contact."""

import math

import numpy as np

from cad.design.parameters import Design
from cad.design.tips import Tips
from cad.quantity import Estimate
from cad.theory.hertz import contact_reach, relative_curvature
from cad.verdict import Verdict
from pipeline.response.scene_press import ScenePress
from pipeline.verdicts.rules import margin_verdict

_NOT_THESE = Verdict(
    name="geometry.tip_shape",
    value=None,
    unit="1",
    limit="cube without fillet",
    tolerance=None,
    passed=False,
    reference="the response is that of the tips asked for, the housing has sharp square ones; choose "
    "tips.socket = 'pin' for ground pins of that shape",
)


def tip_shape_verdicts(design: Design, press: ScenePress) -> tuple[Verdict, ...]:
    """Return geometry.tip_shape where the tips are not those of the housing, and geometry.tip_face [mm] of domes."""
    if design.tips.tip_shape.obeys_hertz:
        return (tip_face_verdict(design, press),)
    return flat_shape_verdicts(design.tips)


def flat_shape_verdicts(tips: Tips) -> tuple[Verdict, ...]:
    """Return geometry.tip_shape where tips that are no domes are not those that a housing is printed with."""
    if tips.socket == "pin" or tips.tip_shape.is_printed:
        return ()
    return (_NOT_THESE,)


def tip_face_verdict(design: Design, press: ScenePress) -> Verdict:
    """Return how far from the axis of its dome a tip is touched at most [mm], which half its face must hold.

    A printed dome ends in a square, whose sides the contact must keep; that of a pin in a circle.
    """
    radius = design.tips.dome_radius_mm or math.inf
    towards = "across the sides of" if design.tips.socket == "none" else "under"
    slopes = [_slope(design, x, y) for x, y in design.tips.places_mm]
    steepest, curvature = max(slopes), relative_curvature(radius, min(design.fruit.radii_mm))
    reaches = [
        contact_reach(force, E, design.fruit.poisson, curvature, slope)
        for E, forces in zip(press.table.E, press.table.F[:, -1], strict=True)
        for force, slope in zip(forces, slopes, strict=True)
        if np.isfinite(force)
    ]
    words = (
        f"farthest contact from the axis of a dome, Hertz, at full travel and every E; the fruit is up to "
        f"{math.degrees(math.atan(steepest)):.2g} deg steep {towards} a tip; must be at most half of tips.side_mm"
    )
    reach = max(reaches, default=0.0)
    return margin_verdict(
        "geometry.tip_face", Estimate(reach, 0.0, "mm"), 0.5 * design.tips.side_mm, words, at_most=True
    )


def _slope(design: Design, x: float, y: float) -> float:
    """Return the slope [1] of the fruit against the face of a tip at a place [mm], tilt and roll of the press added.

    It is the steepest one, or for a printed tip that towards a side of its square.
    """
    press, (radius, across) = design.press, design.fruit.radii_mm
    tilt, roll = (math.tan(math.radians(angle)) for angle in (press.tilt_deg, press.roll_deg))
    slopes = (abs(x) / radius + abs(tilt), abs(y) / across + abs(roll))
    return max(slopes) if design.tips.socket == "none" else math.hypot(*slopes)
