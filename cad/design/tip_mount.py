"""What is printed at the end of a shuttle: the tip itself, or a foot that is wide enough for a pin's pocket."""

from dataclasses import dataclass

from cad.design.parameters import Design
from cad.design.processes import Process
from cad.quantity import fault


@dataclass(frozen=True, kw_only=True)
class TipMount:
    """Sides [mm] of what is printed at the end of a shuttle and of the pocket in it, 0 for a printed tip."""

    side: float
    pocket: float


def tip_mount(design: Design, process: Process) -> TipMount:
    """Return the printed tip, or the foot of a pin: a pocket that the pin fits into, walls around it and its gable.

    Raises InputError when the feet leave no gap between them.
    """
    tips = design.tips
    if tips.socket == "none":
        return TipMount(side=tips.side_mm, pocket=0.0)
    pocket = tips.side_mm + 2.0 * process.accuracy_mm
    side = round(2.0 * (pocket + process.min_wall_mm), 3)
    if side + process.min_gap_mm > tips.spacing_mm:
        bound = f"at least {side + process.min_gap_mm:g} mm, for feet of {side:g} mm with pins in them"
        raise fault("tips.spacing_mm", tips.spacing_mm, "mm", bound, "move the tips apart, or tips.socket = 'none'")
    return TipMount(side=side, pocket=round(pocket, 3))


def plate_depth(design: Design, process: Process) -> float:
    """Return the depth of the plate [mm]: that of the process, more where a tip mount is wider; raises InputError."""
    return max(process.depth_mm, tip_mount(design, process).side)
