"""Tables of weights and of a plate with one fault: it is named, or the stiffnesses stay in their bar.

The units are pairs of the paper with random gains and springs. Counts, dial and travel have noise and are rounded.
"""

from collections import Counter

import numpy as np
import pytest
from measured_units import GRAM, weighed
from refusal import refusal

from sensor.quantity import COVERAGE, InputError

LOADS_G = ((0.0, 10.0, 20.0, 30.0, 40.0), (0.0, 100.0, 200.0, 300.0, 400.0))  # up, and down again
COUNTS_PER_N = (1.5e6, 2.0e5)
NOISE = 40.0  # counts
TINY = 1e-160
TRAVEL_MM = 0.16
FAULTS = ("none", "swapped", "late", "scaled", "dead", "drifting", "coarse", "one row")
WEIGHTS = "tip,weight_g,deflection_mm,counts_l,counts_h"
PLATE = "travel_mm,counts_l,counts_h"


def text_of(head, rows, cell):
    """Return a table whose rows are written by a format."""
    return "\n".join([head, *(cell.format(*row) for row in rows)])


def weights_of(rows):
    return text_of(WEIGHTS, rows, "{},{:g},{:.3f},{:.0f},{:.0f}")


def plate_of(rows, digits=4):
    return text_of(PLATE, rows, f"{{:.{digits}f}},{{:.0f}},{{:.0f}}")


class PlantedUnit:
    """A unit of the pair with springs K [N/mm], 10 % off, and channels of its own, with gains 20 % off."""

    def __init__(self, nominal, rng):
        self.rng = rng
        self.K = nominal * rng.normal(1.0, 0.1, 2).clip(0.75, 1.25)
        crosstalk = np.eye(2) + 0.01 * rng.uniform(-1.0, 1.0, (2, 2)) * (1.0 - np.eye(2))
        self.gains = crosstalk * COUNTS_PER_N * rng.uniform(0.8, 1.2, 2)
        self.zero = rng.uniform(-3e5, 3e5, 2)

    def counts(self, forces):
        """Return whole counts of forces [N], (tips,)."""
        clean = self.zero + self.gains @ forces + NOISE * self.rng.normal(size=2)
        return np.rint(clean).tolist()

    def weights(self):
        """Return the rows of weights, up and down."""
        loads = [GRAM * np.array([*grams, *grams[-2::-1]]) for grams in LOADS_G]
        return weighed(
            ("low", "high"),
            loads,
            lambda tip, load: round(load / self.K[tip] + 3e-4 * self.rng.normal(), 3),
            self.counts,
        )

    def plate(self, late_mm=0.0, drift=0.0, digits=4, stiffer=1.0):
        """Return the rows of a press on a plate, down and up; tips late by [mm], channels that drift.

        `drift` is a fraction of the largest counts of each channel, from the first row to the last.
        """
        steps = np.concatenate([np.linspace(0.1, 1.0, 7), np.linspace(1.0, 0.1, 7)[1:]]) * TRAVEL_MM
        largest = self.gains.diagonal() * self.K * TRAVEL_MM
        rows = []
        for part, travel in zip(np.linspace(0.0, 1.0, len(steps)), steps.tolist(), strict=True):
            counts = self.counts(stiffer * self.K * np.maximum(travel - late_mm, 0.0))
            shown = np.rint(counts + drift * largest * part).tolist()
            rows.append([round(travel + 5e-5 * self.rng.normal(), digits), *shown])
        return rows


def planted(unit, fault):
    """Return the rows of the tables of a unit with a fault of some size, at a place at random."""
    rng = unit.rng
    tip = int(rng.integers(2))
    late = np.eye(2)[tip] * rng.uniform(0.05, 0.3) * TRAVEL_MM if fault == "late" else 0.0
    drift = np.eye(2)[tip] * rng.uniform(-0.1, 0.1) if fault == "drifting" else 0.0
    weights, plate = unit.weights(), unit.plate(late, drift, 2 if fault == "coarse" else 4)
    if fault == "swapped":
        for row in weights if rng.random() < 0.5 else plate:
            row[-2:] = row[:-3:-1]
    elif fault == "scaled":  # the travel, the dial of one tip, or the counts of one channel on the plate
        factor = float(rng.choice([0.1, 0.5, 0.8, 0.9, 0.95, 0.98, 1.02, 1.05, 1.1, 1.25, 2.0, 10.0]))
        kind = int(rng.integers(3))
        rows, column = [(plate, 0), (plate, 1 + tip), (weights[9 * tip : 9 * tip + 9], 2)][kind]
        for row in rows:
            row[column] *= factor
    elif fault == "dead":  # a channel shows one number, in one of the tables or in both
        which = int(rng.integers(3))
        for row in [*(weights if which != 1 else []), *(plate if which != 0 else [])]:
            row[len(row) - 2 + tip] = 4711.0
    elif fault == "one row":
        rows, columns = [(plate, [0, 1 + tip]), (weights, [2, 3 + tip])][int(rng.random() < 0.5)]
        row, column = rows[int(rng.integers(len(rows)))], int(rng.choice(columns))
        row[column] *= float(rng.choice([-1.0, 0.0, 0.9, 1.1, 1.3, 10.0]))
    return weights, plate


@pytest.mark.parametrize("tables", [40, pytest.param(344, marks=pytest.mark.study)])
def test_a_planted_fault_is_named_or_in_the_bar(tables, paper, calibrate):
    """The bar holds 95 % of tables without a fault: one of five, or three of 43, may miss it by chance."""
    rng = np.random.default_rng(23)
    outcomes = Counter()
    for number in range(tables):
        fault = FAULTS[number % len(FAULTS)]
        unit = PlantedUnit(paper.K, rng)
        weights, plate = planted(unit, fault)
        digits = 4 if any(round(row[0], 2) != row[0] for row in plate) else 2
        try:
            found = calibrate(paper.report, weights_of(weights), plate_of(plate, digits)).unit
        except InputError:
            outcomes[fault, "named"] += 1
            continue
        off = np.abs(np.array(found.stiffnesses) / unit.K - 1.0)
        held = (off <= COVERAGE * 0.01 * np.array(found.K_percent)).all()
        outcomes[fault, "in the bar" if held else "wrong"] += 1
    each = tables // len(FAULTS)
    assert outcomes["none", "in the bar"] >= each - max(1, round(0.07 * each))
    assert all(outcomes[fault, "wrong"] <= max(0, round(0.05 * each) - 1) for fault in FAULTS[1:])
    assert (outcomes["swapped", "named"], outcomes["dead", "named"]) == (each, each)


@pytest.fixture
def unit(paper):
    return PlantedUnit(paper.K, np.random.default_rng(4))


@pytest.mark.parametrize(
    ("lines", "column", "value", "place"),
    [
        ([4], 2, 0.9, ", line 4, column 'deflection'"),
        ([5], 1, 300.0, ", line 5, column"),
        ([5], 0, "high", ", line 5, column"),
        ([6], 3, 4194303, ", line 6, column 'counts_l'"),
        ([13], 4, 4194303, ", line 13, column 'counts_h'"),
        (range(2, 20), 3, 0, ": counts_l against the weight on low"),
        (range(2, 20), 4, 0, ": counts_h against the weight on high"),
        (range(2, 20), 1, TINY, ": compliance of low"),
    ],
)
def test_the_row_or_the_column_that_does_not_fit_is_named(
    lines, column, value, place, unit, paper, calibrate, tmp_path
):
    rows = unit.weights()
    assert calibrate(paper.report, weights_of(rows)).unit.stiffnesses == pytest.approx(unit.K.tolist(), rel=0.01)
    for line in lines:
        rows[line - 2][column] = value if value != TINY else value * rows[line - 2][column]
    told = refusal(calibrate, paper.report, weights_of(rows))
    assert told.field.startswith(f"{tmp_path / 'measured.csv'}{place}")
    assert len(lines) > 1 or column < 2 or told.value == value


def test_travels_of_nothing_are_refused(unit, paper, calibrate):
    tiny = text_of(PLATE, unit.plate(), "{}e-300,{:.0f},{:.0f}")
    assert "travel" in str(refusal(calibrate, paper.report, weights_of(unit.weights()), tiny))


def test_channels_on_a_plate_are_compared_with_each_other(unit, paper, calibrate):
    """Three per cent apart are refused, with the tip that weights contradict; less is in the bar."""
    table = weights_of(unit.weights())
    plates = [plate_of(unit.plate(stiffer=np.array([stiffer, 1.0]))) for stiffer in (1.059, 1.02, 1.0)]
    assert "low" in refusal(calibrate, paper.report, table, plates[0]).field
    found, good = (calibrate(paper.report, table, plate).unit for plate in plates[1:])
    assert abs(found.stiffnesses[0] / unit.K[0] - 1.0) < 0.02 * found.K_percent[0]
    assert good.K_percent[0] < 0.5 * found.K_percent[0]
