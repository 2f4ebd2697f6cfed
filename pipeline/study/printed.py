"""A print that misses its drawing: leaves thicker or thinner, plastic stiffer or softer than the process says."""

from collections.abc import Mapping
from dataclasses import replace

from cad.design.parameters import Design
from cad.quantity import as_float, validation_error
from cad.theory.leaf_spring import pair_stiffness
from pipeline.springs.sizing import SpringSizing

THICKNESS = "printed.thickness_offset_mm"
MODULUS = "printed.E_offset"
PRINTED_KEYS = (THICKNESS, MODULUS)
"""Keys of a study that no design file has: what a print adds to each leaf [mm], and to the modulus [1, of it]."""


def printed_sizing(design: Design, drawn: SpringSizing, settings: Mapping[str, object]) -> SpringSizing:
    """Return the sizing with the springs of a print whose leaves were drawn for nominal ones.

    K / K_drawn = (1 + e) (1 + d / t)^3 by the beam law K = 2 E w t^3 / L^3. Raises InputError where nothing is left of
    a leaf or of the modulus, and for leaves with gauges, whose stiffness follows another law.
    """
    thicker = _offset(THICKNESS, settings)
    stiffer = _offset(MODULUS, settings)
    if thicker == 0.0 and stiffer == 0.0:
        return drawn
    if design.print.gauges != "none":
        raise validation_error("print.gauges", design.print.gauges, "", "none where prints vary", "set it under [set]")
    if stiffer <= -1.0:
        raise validation_error(MODULUS, stiffer, "1", "greater than -1", "0.1 is a plastic stiffer by 10 %")
    factors = []
    for thickness in design.process.leaf_thicknesses_mm:
        if thickness + thicker <= 0.0:
            bound = f"greater than -{thickness:g} mm, the whole leaf"
            raise validation_error(THICKNESS, thicker, "mm", bound, "a print misses by some hundredths")
        K_printed = pair_stiffness(1.0 + stiffer, 1.0, thickness + thicker, 1.0)
        factors.append(K_printed / pair_stiffness(1.0, 1.0, thickness, 1.0))
    return replace(drawn, springs=drawn.springs.scaled(factors))


def _offset(key: str, settings: Mapping[str, object]) -> float:
    value = settings.get(key, 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise validation_error(key, str(value), "", "a number", "0 is a print as drawn")
    return as_float(value)
