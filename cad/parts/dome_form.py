"""How far printed domes are off their spheres: by their outline, their radius, and caps at the apex."""

import math

from cad.parts.pin import tip_accuracy_mm
from sensor.design.processes import Process
from sensor.design.tips import Tips

CAPS = (2.0, 3.0)
"""Radii of caps [mm] that are equally likely: a judgement, from five lines of a print to the width of a contact.

A narrower cap lies beside the middle of a contact on a round fruit, where the law of a cap does not hold.
"""


def form_deviations(tips: Tips, process: Process) -> tuple[float, float]:
    """Return how far outlines of domes [mm] and, over itself, their radius [1] are off, one standard deviation each.

    Outlines are off by half the accuracy of their process, or of ground steel. The radius is that of a round face whose
    rim is off by as much. The tips are domes.
    """
    outline = 0.5 * tip_accuracy_mm(tips, process)
    radius = tips.dome_radius_mm or math.inf
    half = min(0.5 * tips.side_mm, radius)
    return outline, outline / (radius - math.sqrt(radius**2 - half**2))
