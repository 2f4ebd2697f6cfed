"""Form errors of printed domes: errors of the outline and the radius, and flat caps at the apex."""

import math

from cad.parts.pin import tip_accuracy_mm
from sensor.design.processes import Process
from sensor.design.tips import Tips

CAPS = (2.0, 3.0)
"""Range of equally likely radii of a flat cap [mm], an estimate: from five printed lines to the contact width.

A narrower cap is not centred in the contact with a round fruit, so that the formula for a cap does not hold.
"""


def form_deviations(tips: Tips, process: Process) -> tuple[float, float]:
    """Return the standard deviation of the outline of domes [mm], and the relative standard deviation of their radius.

    The outline error is half the accuracy of the process, or half the tolerance of ground steel for pins. The radius
    error follows from a spherical face whose rim has this outline error. The tips must be domes.
    """
    outline_error = 0.5 * tip_accuracy_mm(tips, process)  # the accuracy is two standard deviations
    radius = tips.dome_radius_mm or math.inf
    half_width = min(0.5 * tips.side_mm, radius)
    rim_height = radius - math.sqrt(radius**2 - half_width**2)
    return outline_error, outline_error / rim_height
