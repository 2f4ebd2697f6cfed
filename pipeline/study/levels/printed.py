"""A print of a sensor that is not as drawn: leaves thicker or thinner, plastic stiffer or softer than the process says.

The springs are sized for nominal leaves; a print has those of its own thickness and modulus, by the beam law.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cad.design.parameters import Design
from cad.quantity import as_float, validation_error
from cad.theory.leaf_spring import pair_stiffness
from pipeline.springs.sizing import SpringSizing

THICKNESS = "printed.thickness_offset_mm"
MODULUS = "printed.E_offset"
PRINTED_KEYS = (THICKNESS, MODULUS)
"""Keys of a study that no design file has: what a print adds to every leaf [mm], and to the modulus as a share [1]."""


@dataclass(frozen=True, kw_only=True)
class PrintMiss:
    """By how much a print misses its drawing: thickness added to every leaf [mm], and to E as a share of it [1]."""

    thickness_mm: float = 0.0
    E: float = 0.0


AS_DRAWN = PrintMiss()


def print_miss(settings: Mapping[str, object]) -> PrintMiss:
    """Return the miss that the settings of a point name, none where they name none."""
    return PrintMiss(thickness_mm=_number(THICKNESS, settings), E=_number(MODULUS, settings))


def _number(key: str, settings: Mapping[str, object]) -> float:
    value = settings.get(key, 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise validation_error(key, str(value), "", "a number", "0 is a print as drawn")
    return as_float(value)


def printed_sizing(design: Design, drawn: SpringSizing, miss: PrintMiss) -> SpringSizing:
    """Return the sizing with the springs of a print whose leaves were drawn for others.

    K / K_drawn = (1 + e) (1 + d / t)^3, as K = 2 E w t^3 / L^3 of the beam law. Raises InputError where nothing is left
    of a leaf or of the modulus, and for leaves with gauges, whose stiffness follows another law.
    """
    if miss == AS_DRAWN:
        return drawn
    if design.print.gauges != "none":
        raise validation_error("print.gauges", design.print.gauges, "", "none where prints vary", "set it under [set]")
    if miss.E <= -1.0:
        raise validation_error(MODULUS, miss.E, "1", "greater than -1", "0.1 is a plastic stiffer by 10 %")
    factors = []
    for thickness in design.process.leaf_thicknesses_mm:
        if thickness + miss.thickness_mm <= 0.0:
            bound = f"greater than -{thickness:g} mm, the whole leaf"
            raise validation_error(THICKNESS, miss.thickness_mm, "mm", bound, "a print misses by some hundredths")
        thicker = pair_stiffness(1.0 + miss.E, 1.0, thickness + miss.thickness_mm, 1.0)
        factors.append(thicker / pair_stiffness(1.0, 1.0, thickness, 1.0))
    return replace(drawn, springs=drawn.springs.scaled(factors))
