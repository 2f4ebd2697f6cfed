"""Springs from a press on a hard flat plate, which lowers all tips alike: what each channel shows of a deflection.

A modulus follows from small differences of deflections. A channel that weights told is off by what they leave of its
force, and its deflection by what a dial leaves of the spring beside; on a plate all channels see one deflection, but
for what each dome is flattened, as Hertz has it.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from cad.quantity import Estimate, validation_error
from cad.theory.contrast_law import stiffened
from cad.theory.hertz import force_factor
from pipeline.measure.calibrating.channels import ChannelCalibration
from pipeline.measure.calibrating.weighing import FEWEST, line_through
from pipeline.measure.measured_table import LENGTH, MeasuredTable, Quantity, numbers_of, read_csv
from pipeline.measure.unit.signals import COUNTS, count_keys
from pipeline.report.stored import StoredReport

Floats = NDArray[np.float64]

_GLASS_MPA = 70e3 / (1.0 - 0.2**2)  # E / (1 - nu^2) of float glass: EN 572-1
_UNLIKE = 0.1  # of a stiffness: a dial or a balance is less wrong, a unit or a tip beside the plate is more


def measured_plate(source: Path | str, tips: int) -> MeasuredTable:
    """Return the press of a sensor of so many tips on a hard plate: travels and counts; raises InputError."""
    form, rows = read_csv(source)
    keys = count_keys(tips)
    quantities = {"travel": Quantity(units=LENGTH, most=100.0), **dict.fromkeys(keys, COUNTS)}
    return numbers_of(form, rows, quantities, ("travel", *keys), ",".join(["travel_mm", *keys]))


def pressed_springs(
    table: MeasuredTable, channels: ChannelCalibration, weighed: Sequence[Estimate], report: StoredReport
) -> tuple[list[Estimate], list[float]]:
    """Return each spring [N/mm] by its force over its deflection on a plate, and what is left of the deflection [%].

    All tips stand on the plate, of glass, in every row. `weighed` are the springs by weights and dial [N/mm], with half
    of what holds 95 % beside, as those returned have. Raises InputError for fewer than three travels, and for a spring
    that cannot be the one that weights told.
    """
    travel = table.numbers["travel"]
    travels = len(set(travel.tolist()))
    if travels < FEWEST:
        raise validation_error(table.source, travels, "travels", f"at least {FEWEST}", "press in five equal steps")
    keys = count_keys(len(weighed))
    counts = np.column_stack([table.numbers[key] for key in keys]) - channels.zero_counts
    to_force = np.array(channels.newtons_per_count)
    slopes = []
    left_percent = []
    for tip, key in enumerate(keys):
        force = counts @ to_force[tip]
        flattened = flattening(report, force)
        last_digit = np.abs(to_force[tip, tip]) * table.last_digits[key]
        field = f"{table.source}: force of {report.tips[tip].name} over its deflection"
        slope = line_through(field, travel - flattened, force, last_digit, "N/mm")
        slopes.append(slope.value)
        # The modulus of a print scatters, and the flattening goes with its power of two thirds.
        by_modulus = 2.0 / 3.0 * report.design.process.E_scatter * float(np.ptp(flattened) / np.ptp(travel))
        left_percent.append(float(np.hypot(slope.percent, 100.0 * by_modulus)))
    nominal: Floats = np.array(report.read_out.springs_mm_per_N)

    def beside_plate(stiffnesses: Floats) -> Floats:
        """Return how much farther than the plate each tip is lowered, of its travel [1]."""
        factors = stiffnesses * np.diag(nominal)
        return np.asarray(stiffened(nominal.tolist(), factors.tolist()) @ np.array(slopes) - 1.0)

    found = root(beside_plate, [spring.value for spring in weighed])
    springs = []
    names = [tip.name for tip in report.tips]
    rows = zip(names, found.x.tolist(), left_percent, channels.gain_percent, weighed, strict=True)
    for name, K, of_deflection, of_force, by_weights in rows:
        if not (found.success and abs(K / by_weights.value - 1.0) < _UNLIKE):
            field = f"{table.source}: K of {name}"
            bound = f"within {100.0 * _UNLIKE:g} % of that by weights, {by_weights.value:.4g}"
            hint = "check travel and unit, and that all tips stand on the plate in every row"
            raise validation_error(field, K, "N/mm", bound, hint)
        springs.append(Estimate(K, 0.01 * K * float(np.hypot(of_force, of_deflection)), "N/mm"))
    return springs, left_percent


def flattening(report: StoredReport, forces: Floats) -> Floats:
    """Return by how much a tip is flattened on glass [mm] by forces [N]; 0 for a flat face.

    Two elastic bodies: K. L. Johnson, Contact Mechanics (1985), (4.23), doi:10.1017/CBO9781139171731.
    """
    radius = report.design.tips.dome_radius_mm
    if radius is None:
        return np.zeros(len(forces))
    process = report.design.process
    reduced = 1.0 / ((1.0 - process.poisson**2) / process.E_MPa + 1.0 / _GLASS_MPA)
    return np.asarray((np.maximum(forces, 0.0) / force_factor(reduced, radius)) ** (2.0 / 3.0))
