"""What a press on a plate leaves of springs: each cause alone, on tables without noise of their own."""

import numpy as np
import pytest
from measured_units import text_of, weighed
from refusal import refusal

COUNTS_PER_N = 1e6
TRAVEL = np.linspace(0.02, 0.18, 9)  # [mm]
WIGGLE = np.array([1.0, -2.0, 0.0, 2.0, 0.0, -2.0, 0.0, 2.0, -1.0])  # beside any straight line over the travel
T_OF_7 = 2.36  # Student's t of 95 %
WRONG_TRAVEL = 1.5 * np.sqrt(2.0)  # E goes with the power 1.5 of all deflections, and springs count apart


def weights(K, reach=0.3, digits=9):
    """Return weights of springs K [N/mm] that sink in three equal steps [mm], exact but for the digits of a dial."""
    loads = np.outer(K, np.linspace(0.0, reach, 4))
    rows = weighed(("low", "high"), loads, lambda tip, load: f"{load / K[tip]:.{digits}f}", lambda F: COUNTS_PER_N * F)
    rows = [[name, f"{grams:.9f}", *read] for name, grams, *read in rows]
    return text_of("tip,weight_g,deflection_mm,counts_l,counts_h", rows)


def plate(K, travel=TRAVEL, moved=0.0):
    """Return a press on a plate of springs K [N/mm], whose low one moved by more [mm], with the travel as written."""
    counts = COUNTS_PER_N * K * np.column_stack([TRAVEL + moved, TRAVEL])
    rows = [[f"{x:.9f}", *each] for x, each in zip(travel, counts.round(6).tolist(), strict=True)]
    return text_of("travel_mm,counts_l,counts_h", rows)


def of_scatter(deviations):
    """Return the relative error of a slope over the travel with some deviations [mm] beside its line."""
    about = TRAVEL - TRAVEL.mean()
    return 0.5 * T_OF_7 * np.linalg.norm(deviations) / np.sqrt(7.0) / np.linalg.norm(about)


def off_all(off):
    """Return the error by a stiffness that differs by a fraction from the one of the weights, alike on both springs."""
    return WRONG_TRAVEL * off / np.sqrt(3.0)


HALF = of_scatter(1e-4 * WIGGLE)
CASES = {
    # travel as written, factor of the low spring on the plate, its deviations [mm], errors of K and of deflections [1]
    "exact": (TRAVEL, 1.0, 0.0, 1e-4, 1e-4),
    "travel too long": (1.02 * TRAVEL, 1.0, 0.0, off_all(0.02 / 1.02), 1e-4),
    "low spring stiffer": (TRAVEL, 1.02, 0.0, np.hypot(off_all(0.01), 0.01 / 1.01 / np.sqrt(3.0)), 1e-4),
    "travel scatters": (TRAVEL + 2e-4 * WIGGLE, 1.0, 0.0, WRONG_TRAVEL * 2.0 * HALF, 1e-4),
    "low channel scatters": (TRAVEL, 1.0, 2e-4 * WIGGLE, np.hypot(1.0, WRONG_TRAVEL) * HALF, HALF),
}


@pytest.mark.parametrize(("travel", "factor", "moved", "error", "left"), CASES.values(), ids=CASES)
def test_each_cause_widens_both_springs_by_its_size(travel, factor, moved, error, left, paper, calibrate):
    """Half of what one of two channels scatters is taken for a travel that was read wrong, half for its own."""
    K = paper.K * (factor, 1.0)
    unit = calibrate(paper.report, weights(paper.K), plate(K, travel, moved)).unit
    assert unit.K_percent == pytest.approx(2 * [100.0 * error], rel=0.02)
    assert unit.gain_percent == pytest.approx(2 * [100.0 * left], rel=0.02)
    assert unit.stiffnesses == pytest.approx((K / np.polyfit(TRAVEL, travel, 1)[0]).tolist(), rel=1e-3)


def test_a_channel_that_bends_by_more_than_a_tenth_is_refused(paper, calibrate, tmp_path):
    """Its slope changes over the press by a fraction of the slope at the middle; both springs remain as they are."""
    about = (TRAVEL - TRAVEL.mean()) ** 2
    tables = [plate(paper.K, moved=0.5 * change / np.ptp(TRAVEL) * (about - about.mean())) for change in (0.09, 0.15)]
    assert calibrate(paper.report, weights(paper.K), tables[0]).unit.deflection_bend is not None
    told = refusal(calibrate, paper.report, weights(paper.K), tables[1])
    where = "change of the slope of counts_l from the first row to the last"
    assert told.field == f"{tmp_path / 'measured.csv'}: {where}"
    assert told.value == pytest.approx(0.15, rel=0.01)


@pytest.mark.parametrize(("reach", "notes"), [(0.3, 1), (0.12, 0)])
def test_a_plate_that_leaves_more_than_twice_the_bar_of_the_weights_is_noted(reach, notes, paper, calibrate):
    """It leaves 1.03 % (95 %); a dial of a micrometre leaves 0.26 % of 0.3 mm, 0.65 % of 0.12 mm."""
    table = plate(paper.K, TRAVEL + 2e-4 * WIGGLE)
    found = calibrate(paper.report, weights(paper.K, reach, digits=3), table)
    assert 2.0 * found.unit.K_percent[0] == pytest.approx(1.03, rel=0.05)
    assert len(found.assumed) == notes
