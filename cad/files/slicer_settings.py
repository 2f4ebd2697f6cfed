"""The settings of PrusaSlicer that determine the stiffness of a print."""

import math

from cad.parts.housing import Housing
from sensor.design.processes import FOOT_MM, Process

_LINE_TYPES = ("external_perimeter", "perimeter", "infill", "solid_infill", "top_infill")
_ROUND_OFF = 1e-6  # tolerance for the round-off error of the number of lines


def slicer_settings(process: Process, housing: Housing) -> dict[str, str]:
    """Return the PrusaSlicer settings, by key, that print a housing as modelled: solid, with lines along its leaves.

    Processes that do not print lines have no settings. The print profile sets the printer and the filament. The profile
    also sets the height of the first layer, because PrusaSlicer cannot set this height for a single object.
    """
    width = process.line_width_mm
    if process.kind != "fdm" or width is None:
        return {}
    line_count = max(arm.flexure.thickness for arm in housing.arms) / width  # number of lines across the thickest leaf
    settings = {
        "layer_height": process.layer_mm,
        "extrusion_width": width,
        **{f"{name}_extrusion_width": width for name in _LINE_TYPES},
        "perimeters": math.ceil(0.5 * line_count - _ROUND_OFF),  # a perimeter has a line on both sides of a leaf
        "fill_density": "100%",
        "fill_pattern": "rectilinear",
        "elefant_foot_compensation": FOOT_MM,
        "support_material": 0,
        "brim_type": "no_brim",
    }
    texts = {}
    for key, value in settings.items():
        # A process may have no layer height. The slicer then uses the value of its print profile.
        if value is not None:
            texts[key] = f"{value:g}" if isinstance(value, float) else str(value)
    return texts
