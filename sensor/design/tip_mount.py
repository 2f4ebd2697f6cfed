"""The printed end of a shuttle, which is the tip or a foot for a pin, and the depth of the plate that it requires.

The two plates of a square stand back to back on opposite sides of it, separated by their pads. So each is less deep
than the square is wide.
"""

from typing import NamedTuple

from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.quantity import validation_error

_LEAST_PAD_MM = 0.2  # two layers of a coarse print
_LEAST_ASPECT = 2.0  # depth of a leaf over its thickness: a shallower one is a rod, as soft sideways


class TipMount(NamedTuple):
    """The printed end of a shuttle [mm]: its side, and the side of the pocket in it, which is None for a tip."""

    side: float
    pocket_side: float | None = None


def tip_mount(design: Design, process: Process) -> TipMount:
    """Return the tip, or the foot for a pin, at the end of a shuttle.

    A foot has a pocket for the pin. Half the side of the foot is a full side of the pocket plus a wall, because the
    gable of the pocket ends a full side above its middle. Raises InputError if the feet leave no gap between them.
    """
    tips = design.tips
    if tips.socket == "none":
        return TipMount(side=tips.side_mm)
    pocket = tips.side_mm + 2.0 * process.accuracy_mm
    side = round(2.0 * (pocket + process.min_wall_mm), 3)
    if side + process.min_gap_mm > tips.spacing_mm:
        bound = f"at least {side + process.min_gap_mm:g} mm, for feet of {side:g} mm with pins in them"
        raise validation_error(
            "tips.spacing_mm", tips.spacing_mm, "mm", bound, "move the tips apart, or tips.socket = 'none'"
        )
    return TipMount(side=side, pocket_side=round(pocket, 3))


def plate_depth(design: Design, process: Process) -> float:
    """Return the depth of the plate [mm]: the depth of the process, or the tip mount if it is wider.

    A line has no plate; its leaves have the depth of the process. Raises InputError if the tips of a square are too
    close for two plates.
    """
    if not design.tips.tip_layout.has_housing:
        return process.depth_mm
    side = tip_mount(design, process).side
    if not design.tips.tip_layout.is_back_to_back:
        return max(process.depth_mm, side)
    spacing = design.tips.spacing_mm
    pads = 2.0 * pad_height(process)
    depth = round(spacing - pads, 3)
    least = max(side, _LEAST_ASPECT * max(process.leaf_thicknesses_mm))
    if depth < least:
        what = "a tip is wide" if side == least else f"two leaf thicknesses of {process.name}"
        bound = f"at least {least + pads:g} mm: a plate as deep as {what}, {least:g} mm, and two pads of {0.5 * pads:g}"
        raise validation_error("tips.spacing_mm", spacing, "mm", bound, "move the tips apart, or take narrower tips")
    return depth


def pad_height(process: Process) -> float:
    """Return the height of the pads on the back of a plate of a square [mm]; two make the least gap of the process."""
    return max(_LEAST_PAD_MM, 0.5 * process.min_gap_mm)
