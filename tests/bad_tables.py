"""Calibration tables with one planted fault each: the fault is named, or the stiffnesses lie within their error bars.

The tables are of weights and of a press on a plate. The units are pairs of the paper with random gains and springs.
Counts, dial and travel have noise and are rounded.
"""

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from instrument.calibrate.calibration import calibrate_unit, measured_print
from instrument.calibrate.plate import measured_plate
from pipeline.report.report import Report
from sensor.arrays import Floats
from sensor.quantity import COVERAGE, InputError

GRAM = 9.80665e-3  # [N]
LOADS_G = ((0.0, 10.0, 20.0, 30.0, 40.0), (0.0, 100.0, 200.0, 300.0, 400.0))  # up, and down again
COUNTS_PER_N = (1.5e6, 2.0e5)
NOISE = 40.0  # counts
TRAVEL_MM = 0.16
FAULTS = ("swapped", "late", "scaled", "dead", "drifting", "coarse", "one row")

Tables = tuple[list[list[float]], list[list[float]]]
"""Rows of weights: tip, weight [g], deflection [mm], counts; and of a plate: travel [mm], counts."""


class PlantedUnit:
    """A unit of the pair with springs K [N/mm] and channels of its own."""

    def __init__(self, nominal: Floats, rng: np.random.Generator) -> None:
        """Draw springs 10 % and gains 20 % off."""
        self.rng = rng
        self.K = nominal * rng.normal(1.0, 0.1, 2).clip(0.75, 1.25)
        crosstalk = np.eye(2) + 0.01 * rng.uniform(-1.0, 1.0, (2, 2)) * (1.0 - np.eye(2))
        self.gains = crosstalk * COUNTS_PER_N * rng.uniform(0.8, 1.2, 2)
        self.zero = rng.uniform(-3e5, 3e5, 2)

    def counts(self, forces: Floats) -> list[float]:
        """Return whole counts of forces [N], (tips,)."""
        clean = self.zero + self.gains @ forces + NOISE * self.rng.normal(size=2)
        return list(np.rint(clean).tolist())

    def tables(self, late_mm: Floats, drift: Floats, digits: int) -> Tables:
        """Return weights up and down, and a press on a plate down and up; tips late by [mm], channels that drift.

        `drift` is a fraction of the largest counts of each channel, from the first row of the plate to the last.
        """
        weights = []
        for tip, loads in enumerate(LOADS_G):
            for load in (*loads, *loads[-2::-1]):
                force = np.zeros(2)
                force[tip] = load * GRAM
                deflection = force[tip] / self.K[tip] + 3e-4 * self.rng.normal()
                weights.append([float(tip), load, round(deflection, 3), *self.counts(force)])
        steps = np.concatenate([np.linspace(0.1, 1.0, 7), np.linspace(1.0, 0.1, 7)[1:]]) * TRAVEL_MM
        largest = self.gains.diagonal() * self.K * TRAVEL_MM
        plate = []
        for row, travel in enumerate(steps.tolist()):
            force = self.K * np.maximum(travel - late_mm, 0.0)
            moved = drift * largest * row / (len(steps) - 1)
            counts = np.rint(np.array(self.counts(force)) + moved)
            plate.append([round(travel + 5e-5 * self.rng.normal(), digits), *counts.tolist()])
        return weights, plate


def planted(unit: PlantedUnit, fault: str) -> Tables:
    """Return the tables of a unit with a fault of some size, at a place at random."""
    rng = unit.rng
    tip = int(rng.integers(2))
    of_tip = np.eye(2)[tip]
    late = of_tip * rng.uniform(0.05, 0.3) * TRAVEL_MM if fault == "late" else np.zeros(2)
    drift = of_tip * rng.uniform(-0.1, 0.1) if fault == "drifting" else np.zeros(2)
    weights, plate = unit.tables(late, drift, 2 if fault == "coarse" else 4)
    if fault in _SPOILERS:
        _SPOILERS[fault](rng, tip, weights, plate)
    return weights, plate


def _swapped(rng: np.random.Generator, _tip: int, weights: list[list[float]], plate: list[list[float]]) -> None:
    """Swap both channels in one of the tables."""
    for row in weights if rng.random() < 0.5 else plate:
        row[-2], row[-1] = row[-1], row[-2]


def _scaled(rng: np.random.Generator, tip: int, weights: list[list[float]], plate: list[list[float]]) -> None:
    """Scale the travel of the plate, the dial of one tip, or the counts of one channel on the plate."""
    factor = float(rng.choice([0.1, 0.5, 0.8, 0.9, 0.95, 0.98, 1.02, 1.05, 1.1, 1.25, 2.0, 10.0]))
    kind = int(rng.integers(3))
    for row in plate:
        if kind == 0:
            row[0] *= factor
        elif kind == 1:
            row[1 + tip] = round(factor * row[1 + tip])
    for row in weights:
        if kind == 2 and row[0] == tip:
            row[2] *= factor


def _dead(rng: np.random.Generator, tip: int, weights: list[list[float]], plate: list[list[float]]) -> None:
    """Let a channel show one number, in one of the tables or in both."""
    which = int(rng.integers(3))
    for row in [*(weights if which != 1 else []), *(plate if which != 0 else [])]:
        row[len(row) - 2 + tip] = 4711.0


def _one_row(rng: np.random.Generator, tip: int, weights: list[list[float]], plate: list[list[float]]) -> None:
    """Spoil one number of one row."""
    rows = weights if rng.random() < 0.5 else plate
    row = rows[int(rng.integers(len(rows)))]
    column = int(rng.choice([2, 3 + tip])) if rows is weights else int(rng.choice([0, 1 + tip]))
    row[column] = row[column] * float(rng.choice([-1.0, 0.0, 0.9, 1.1, 1.3, 10.0]))


_SPOILERS: dict[str, Callable[[np.random.Generator, int, list[list[float]], list[list[float]]], None]] = {
    "swapped": _swapped,
    "scaled": _scaled,
    "dead": _dead,
    "one row": _one_row,
}


def outcome(report: Report, unit: PlantedUnit, tables: Tables, folder: Path) -> str:
    """Return the outcome of a calibration by tables: named, in the bar, or wrong.

    The first is an error before any unit is made, the others say whether both stiffnesses lie within their error bars.
    """
    weights, plate = tables
    names = [tip.name for tip in report.tips]
    lines = ["tip,weight_g,deflection_mm,counts_l,counts_h"]
    lines += [
        f"{names[int(tip)]},{load:g},{deflection:.3f},{low:.0f},{high:.0f}"
        for tip, load, deflection, low, high in weights
    ]
    digits = 4 if any(round(row[0], 2) != row[0] for row in plate) else 2
    on_plate = ["travel_mm,counts_l,counts_h", *(f"{x:.{digits}f},{low:.0f},{high:.0f}" for x, low, high in plate)]
    (folder / "weights.csv").write_text("\n".join(lines), encoding="utf-8")
    (folder / "plate.csv").write_text("\n".join(on_plate), encoding="utf-8")
    try:
        table = measured_print(folder / "weights.csv", report)
        found = calibrate_unit(report, table, plate=measured_plate(folder / "plate.csv", report)).unit
    except InputError:
        return "named"
    off = np.abs(np.array(found.stiffnesses) / unit.K - 1.0)
    return "in the bar" if (off <= COVERAGE * 0.01 * np.array(found.K_percent)).all() else "wrong"


def outcomes(report: Report, tables: int, seed: int) -> dict[str, Counter[str]]:
    """Return the outcomes of so many tables, counted for each fault; those without one stand beside as `none`."""
    rng = np.random.default_rng(seed)
    nominal = np.array([1.0 / row[tip] for tip, row in enumerate(report.read_out.springs_mm_per_N)])
    counted: dict[str, Counter[str]] = {fault: Counter() for fault in ("none", *FAULTS)}
    with TemporaryDirectory() as folder:
        for number in range(tables):
            fault = ("none", *FAULTS)[number % (len(FAULTS) + 1)]
            unit = PlantedUnit(nominal, rng)
            counted[fault][outcome(report, unit, planted(unit, fault), Path(folder))] += 1
    return counted
