"""Springs from a press on a hard flat plate, which lowers all tips alike: what each channel shows of a deflection.

A modulus follows from small differences of deflections. A channel that weights told is off by what they leave of its
force, and its deflection by what a dial leaves of the spring beside; on a plate all channels see one deflection.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from cad.quantity import Estimate, validation_error
from cad.theory.contrast_law import stiffened
from pipeline.measure.calibrating.channels import ChannelCalibration
from pipeline.measure.calibrating.weighing import FEWEST, line_through
from pipeline.measure.measured_table import LENGTH, MeasuredTable, Quantity, numbers_of, read_csv
from pipeline.measure.unit.signals import COUNTS, count_keys
from pipeline.report.stored import StoredReport

Floats = NDArray[np.float64]

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
    """Return each spring [N/mm] by its force over the travel of a plate, and what is left of its deflection [%].

    All tips stand on the plate in every row. `weighed` are the springs by weights and dial [N/mm]; those returned have
    half of what holds 95 % beside, too. Raises InputError for fewer than three travels, and for a spring that cannot be
    the one that weights told.
    """
    travel = table.numbers["travel"]
    travels = len(set(travel.tolist()))
    if travels < FEWEST:
        raise validation_error(table.source, travels, "travels", f"at least {FEWEST}", "press in five equal steps")
    slopes = []
    for key in count_keys(len(weighed)):
        field = f"{table.source}: {key} over the travel"
        slopes.append(line_through(field, travel, table.numbers[key], table.last_digits[key], "counts/mm"))
    forces = np.array(channels.newtons_per_count) @ [slope.value for slope in slopes]  # per travel [N/mm]
    nominal: Floats = np.array(report.read_out.springs_mm_per_N)

    def beside_plate(stiffnesses: Floats) -> Floats:
        """Return how much farther than the plate each tip is lowered, of its travel [1]."""
        factors = stiffnesses * np.diag(nominal)
        return np.asarray(stiffened(nominal.tolist(), factors.tolist()) @ forces - 1.0)

    found = root(beside_plate, [spring.value for spring in weighed])
    springs = []
    rows = zip(report.tips, found.x.tolist(), slopes, channels.gain_percent, weighed, strict=True)
    for tip, K, slope, left, by_weights in rows:
        if not (found.success and abs(K / by_weights.value - 1.0) < _UNLIKE):
            field = f"{table.source}: K of {tip.name}"
            bound = f"within {100.0 * _UNLIKE:g} % of that by weights, {by_weights.value:.4g}"
            hint = "check travel and unit, and that all tips stand on the plate in every row"
            raise validation_error(field, K, "N/mm", bound, hint)
        springs.append(Estimate(K, K * float(np.hypot(0.01 * left, slope.relative)), "N/mm"))
    return springs, [slope.percent for slope in slopes]
