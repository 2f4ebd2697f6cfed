"""The printed end of a shuttle, which is a tip or a foot for a pin, and the depth of the plate that it requires.

In a square of tips, the two plates are mounted back to back on opposite sides of the square, separated by their pads.
So the depth of a plate is less than the width of the square.
"""

from typing import NamedTuple

from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.quantity import validation_error

_MIN_PAD_MM = 0.2
"""Minimum height of a pad: the thickness of two layers of a coarse print."""
_MIN_ASPECT = 2.0
"""Minimum ratio of the depth of a leaf to its thickness. A leaf with a smaller ratio is nearly as soft sideways."""


class TipMount(NamedTuple):
    """The printed end of a shuttle [mm]: its side, and the side of the pocket for a pin. A tip has no pocket."""

    side: float
    pocket_side: float | None = None


def tip_mount(design: Design, process: Process) -> TipMount:
    """Return the printed end of a shuttle: a tip, or a foot with a pocket for a pin.

    The gable of a pocket ends a full side of the pocket above its centre. Half the side of a foot is therefore a full
    side of the pocket plus a wall. The sides are rounded to 0.001 mm. Raises InputError if there is no gap between the
    feet.
    """
    tips = design.tips
    if tips.socket == "none":
        return TipMount(side=tips.side_mm)
    pocket = tips.side_mm + 2.0 * process.accuracy_mm  # a clearance on each side of the pin
    side = round(2.0 * (pocket + process.min_wall_mm), 3)
    if side + process.min_gap_mm > tips.spacing_mm:
        bound = f"at least {side + process.min_gap_mm:g} mm, because pins need feet of {side:g} mm"
        hint = "move the tips farther apart, or choose tips.socket = 'none'"
        raise validation_error("tips.spacing_mm", tips.spacing_mm, "mm", bound, hint)
    return TipMount(side=side, pocket_side=round(pocket, 3))


def plate_depth(design: Design, process: Process) -> float:
    """Return the depth of the plate [mm], which is also the width of its leaves.

    The plate has the depth of the process, or the side of the tip mount if that is larger. The two plates of a square
    lie within the spacing of the tips, so each is as deep as the spacing minus the pads. A line has no plate, so its
    leaves have the depth of the process. Raises InputError if the plates of a square would be too shallow for a tip or
    a leaf.
    """
    if not design.tips.tip_layout.has_housing:
        return process.depth_mm
    side = tip_mount(design, process).side
    if not design.tips.tip_layout.is_back_to_back:
        return max(process.depth_mm, side)
    spacing = design.tips.spacing_mm
    pads = 2.0 * pad_height(process)
    depth = round(spacing - pads, 3)
    min_depth = max(side, _MIN_ASPECT * max(process.leaf_thicknesses_mm))
    if depth < min_depth:
        required_depth = "a tip is wide" if side == min_depth else f"two leaf thicknesses of {process.name}"
        plate = f"a plate as deep as {required_depth}, {min_depth:g} mm"
        bound = f"at least {min_depth + pads:g} mm: {plate}, and two pads of {0.5 * pads:g}"
        hint = "move the tips farther apart, or choose narrower tips"
        raise validation_error("tips.spacing_mm", spacing, "mm", bound, hint)
    return depth


def pad_height(process: Process) -> float:
    """Return the height of the pads on the back of a plate [mm]. Two pads fill at least the minimum gap."""
    return max(_MIN_PAD_MM, 0.5 * process.min_gap_mm)
