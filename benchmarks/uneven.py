"""The uncertainty of a reading due to uneven skin and flesh, for several radii and spacings of a preset's domes.

`python -m benchmarks.uneven` (a minute) writes a section of docs/measurements.md.
"""

import sys
from dataclasses import replace

from benchmarks.harness import section, write_section
from pipeline.options import load_design
from pipeline.reading.analysis import ReadingAccuracy
from pipeline.sensor import Sensor
from sensor.design.parameters import Design
from sensor.quantity import InputError
from solve.linear import SolveError

DESIGN = "mango"
RADII = (7.0, 9.8, 14.0)  # radii of the domes [mm]
SPACINGS = (6.3, 9.0, 12.0)  # distances between adjacent tips [mm]
TRAVELS = (1.13, 1.6)  # travels of a press [mm]
SIDE_PER_RADIUS = 1.9  # side of the face of a dome divided by its radius, so that the face includes the contact [1]
PAD_GAP = 0.5  # smallest gap between the plates of two tips [mm], for their pads
PIECE = {6.3: 24.0, 9.0: 26.0, 12.0: 30.0}  # side of the modelled piece of fruit [mm], by spacing
HEADS = [
    *("dome mm", "spacing mm", "travel mm", "skin %", "flesh %", "one press %", "three presses %"),
    *("instrument %", "pressure / limit", "bias %", "last touch"),
]
INTRODUCTION = """\
`python -m benchmarks.uneven` writes this table. It changes the domes of `mango`, their spacing and the travel, and
keeps its springs. The face of a dome is as wide as its contact needs. The columns give the largest value over all
moduli, as standard uncertainties: of one press by skin, by flesh and by both, of the mean of three presses, and of the
instrument on even fruit. The pressure on the skin is divided by its limit, so above 1 the fruit is bruised. The last
touch is the fraction of the travel at which the last tip touches; its limit is 0.5.

Wider domes do not help: they indent the flesh less, so that the same heights are a larger part of a press. Narrower
domes, more travel and more spacing help, but the first two bruise the fruit, and spacing costs bias. So more presses
cost least."""


def dome_row(radius: float, spacing: float, travel: float) -> list[str]:
    """Return the table row for a dome radius, a spacing and a travel [mm].

    If the design is rejected, the reason is printed. A design that is rejected or has no reading has a row with dashes.
    """
    size_cells = [f"{radius:g}", f"{spacing:g}", f"{travel:g}"]
    dashes = ["-" for _ in HEADS[len(size_cells) :]]
    design = load_design(DESIGN)
    try:
        readings = Sensor(design=changed_design(design, radius, spacing, travel), springs_as="sized").readings
    except (InputError, SolveError) as error:
        print(error)
        return [*size_cells, *dashes]
    if readings is None or not readings.moduli:
        return [*size_cells, *dashes]
    return [*size_cells, *(f"{number:.2g}" for number in largest_numbers(readings))]


def largest_numbers(readings: ReadingAccuracy) -> tuple[float, ...]:
    """Return the numbers of the accuracy of readings that the table shows, in the order of the last eight `HEADS`."""
    uneven = [row.uneven for row in readings.moduli if row.uneven is not None]
    return (
        max(errors.skin_percent for errors in uneven),
        max(errors.flesh_percent for errors in uneven),
        max(errors.one_press_percent for errors in uneven),
        max(errors.presses_percent for errors in uneven),
        100.0 * max(row.sources.total for row in readings.moduli),
        max(pressure.over_limit for pressure in readings.pressures),
        100.0 * (readings.bias.value if readings.bias else 0.0),
        readings.touch.value,
    )


def changed_design(design: Design, radius: float, spacing: float, travel: float) -> Design:
    """Return a design with another dome radius, spacing and travel [mm], on a piece of fruit of sufficient size.

    Raises InputError if the design is impossible.
    """
    side = min(SIDE_PER_RADIUS * radius, spacing - PAD_GAP)
    return replace(
        design,
        tips=replace(design.tips, dome_radius_mm=radius, side_mm=side, spacing_mm=spacing),
        press=replace(design.press, travel_mm=travel),
        fruit=replace(design.fruit, length_mm=PIECE[spacing], width_mm=PIECE[spacing]),
    )


def main() -> int:
    """Write and print the table."""
    rows = []
    for radius in RADII:
        for spacing in SPACINGS:
            for travel in TRAVELS:
                rows.append(dome_row(radius, spacing, travel))
                print(rows[-1], flush=True)
    write_section("Uneven skin and flesh", INTRODUCTION, [section("Domes of mango", HEADS, rows)])
    return 0


if __name__ == "__main__":
    sys.exit(main())
