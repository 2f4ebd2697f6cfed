"""Form errors of printed domes: the errors of outline and radius, and flat caps at the apex."""

import math

from cad.parts.pin import tip_accuracy_mm
from sensor.design.processes import Process
from sensor.design.tips import Tips

CAPS = (2.0, 3.0)
"""Range of equally likely cap radii [mm]; a judgement, from five printed lines to the width of a contact.

A narrower cap is not centred in the contact with a round fruit, and then the law of a cap does not hold.
"""


def form_deviations(tips: Tips, process: Process) -> tuple[float, float]:
    """Return the standard deviation of the outline of domes [mm], and the relative one of their radius [1].

    The outline error is half the accuracy of the process, or of ground steel for pins. The radius error is that of a
    spherical face whose rim has this outline error. The tips must be domes.
    """
    outline_error = 0.5 * tip_accuracy_mm(tips, process)
    radius = tips.dome_radius_mm or math.inf
    half_width = min(0.5 * tips.side_mm, radius)
    return outline_error, outline_error / (radius - math.sqrt(radius**2 - half_width**2))
