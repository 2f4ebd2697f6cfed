"""A print that is off is found by weights and by its coupon; what it then reads, and how it is trimmed."""

from dataclasses import replace

import numpy as np
import pytest
from measured_units import GRAM, read_press, text_of, weighed
from refusal import refusal
from stand_ins import default_housing

from cad.parts.coupon import modulus_factor
from instrument.calibrate.calibration import modulus_of_coupon, read_print_table
from instrument.calibrate.unit_table import level_press, unit_table
from sensor.theory.leaf_spring import pair_length, pair_stiffness

THICKER = (1.19, 1.11)  # leaves of 0.8 and 1.2 mm that are 0.05 mm too thick
TIPS = "tip,weight_g,deflection_mm"


@pytest.fixture
def housed(paper):
    """Return the report of the pair with a housing, whose leaves may be trimmed."""
    return replace(paper.report, housing=default_housing())


@pytest.mark.parametrize("name", ["paper", "mango"])
def test_table_of_a_unit_is_that_of_its_springs(name, request):
    """The error is that of reading with each spring 1 % off, and of the form of domes; P is of means of like tips."""
    measured = request.getfixturevalue(name)
    sensor = measured.measuring(percent=1.0)
    thinner = measured.measuring(1.0 / np.array(measured.design.tips.each(*THICKER)))
    rows = unit_table(sensor, thinner)
    assert pytest.approx([0.5, 3.5]) == [rows[0].E, rows[-1].E]
    row = rows[0]
    low, high = ([row.forces[tip] for tip in kind] for kind in measured.design.tips.spring_groups)
    assert pytest.approx(np.mean(high) / np.mean(low)) == row.P
    press = level_press(sensor, row.E)
    reading = read_press(sensor, press)
    assert pytest.approx(1.0 + row.with_design, rel=5e-3) == read_press(thinner, press).E / reading.E
    moved = []
    for tip in range(len(row.forces)):
        E = read_press(sensor.with_stiffness(tip, 1.001), press).E
        moved.append(10.0 * (E / reading.E - 1.0))
    assert row.u == pytest.approx(2.0 * np.linalg.norm([*moved, *sensor.form_deviations(row.E)]), rel=0.01)


def test_springs_that_read_nothing_of_a_unit_leave_its_table_open(paper):
    """The design's low spring is taken for stiffer than its high one: the forces belong to no modulus of it."""
    sensor = paper.measuring()
    assert {row.with_design for row in unit_table(sensor, sensor.with_stiffness(0, 30.0))} == {None}


def weights_of(names, K, loads):
    """Return a table of loads [N] on springs K [N/mm], which a dial shows exactly, but for a zero of its own."""
    rows = weighed(names, [loads] * len(K), lambda tip, load: f"{load / K[tip] + 0.03:.9f}")
    return text_of(TIPS, rows)


def test_weights_tell_the_springs_and_how_to_trim_them(housed, paper, calibrate):
    """A stiff spring is filed longer, a soft one clamped shorter, by what the beam formula needs; the zero is off."""
    K = paper.K * (1.2, 0.9)
    calibration = calibrate(housed, weights_of(("low", "high"), K, (0.0, 20.0 * GRAM, 40.0 * GRAM)))
    assert calibration.unit.stiffnesses == pytest.approx(K.tolist(), rel=1e-6)
    assert [longer > 0.0 for longer in calibration.trims] == [True, False]
    for longer, own, target, arm in zip(calibration.trims, K, paper.K, housed.housing.arms, strict=True):
        leaf = arm.flexure
        acting = own / pair_stiffness(1.0, leaf.depth, leaf.thickness, leaf.length)
        trimmed = pair_stiffness(acting, leaf.depth, leaf.thickness, leaf.length + longer)
        assert trimmed == pytest.approx(target, rel=1e-6)


@pytest.mark.parametrize(("digits", "known"), [(1, False), (9, True)])
def test_no_cut_is_named_for_a_spring_whose_error_holds_its_target(digits, known, housed, paper, calibrate):
    """A dial to 0.1 mm leaves K to tens of per cent; the same spring read to 1 um is known to be too stiff."""
    rows = []
    for name, K in zip(("low", "high"), 1.05 * paper.K, strict=True):
        rows += [[name, f"{x * K / GRAM:.6f}", f"{x:.{digits}f}"] for x in (0.0, 0.1, 0.2, 0.3)]
    assert [longer is not None for longer in calibrate(housed, text_of(TIPS, rows)).trims] == [known, known]


def test_second_print_from_the_coupon_is_within_a_hundredth(housed, rng, tmp_path, paper):
    """A print whose material is 15 % softer: its coupon shows the modulus that makes the second print right."""
    modulus = 0.85 * housed.design.process.E_MPa
    rows = []
    for arm in housed.housing.arms:
        for weight in (0, 5, 10, 15, 20):
            sag = modulus_factor(arm.flexure) * weight * GRAM / modulus
            rows.append(f"{arm.name},{weight},{sag * (1.0 + 0.005 * rng.normal()):.6f}")
    E = coupon(rows, housed, tmp_path / "coupon.csv")
    for arm, K in zip(housed.housing.arms, paper.K, strict=True):
        leaf = arm.flexure
        length = pair_length(E.value, leaf.depth, leaf.thickness, K)
        assert pair_stiffness(modulus, leaf.depth, leaf.thickness, length) == pytest.approx(K, rel=0.01)
    assert 1e-4 * E.value < abs(modulus - E.value) <= 2.0 * E.error < 0.02 * E.value


COUPON = ("low,0,0", "low,5,0.733", "low,10,1.464", "high,0,0", "high,50,0.383", "high,100,0.765")


def coupon(rows, report, path):
    path.write_text("\n".join(["coupon,weight_g,deflection_mm", *rows]), encoding="utf-8")
    return modulus_of_coupon(read_print_table(path, report), report)


def test_leaves_of_a_coupon_are_named_as_tips_are(housed, tmp_path):
    path = tmp_path / "coupon.csv"
    plain = coupon(COUPON, housed, path)
    initials = [row.replace("low", "L").replace("high", "High") for row in COUPON]
    assert coupon(initials, housed, path) == plain
    assert coupon(COUPON[:3], housed, path).value == pytest.approx(plain.value, rel=0.01)
    told = refusal(coupon, [*COUPON, "arm,0,0"], housed, path)
    assert (told.field, told.value) == (f"{path}, line 8, column 'coupon'", "arm")


def test_a_coupon_that_bends_is_wider_by_its_bend(housed, tmp_path):
    """The modulus of one leaf whose slope changes by 4 %: anywhere within 2 % to either side."""
    rows = [f"low,{load},{0.15 * load * (1.0 + 0.02 * load / 20.0):.9f}" for load in (0, 5, 10, 15, 20)]
    found = coupon(rows, housed, tmp_path / "coupon.csv")
    assert found.relative == pytest.approx(0.02 / 1.02 / np.sqrt(3.0), rel=0.01)


def test_gains_without_counts_are_as_certain_as_the_design_with_their_drift(mango, calibrate):
    """A drift lies anywhere within its bound."""
    table = weights_of([tip.name for tip in mango.report.tips], mango.K, (0.0, GRAM, 2.0 * GRAM))
    drifts = np.array(mango.report.read_out.signal.gain_drift_percent)
    expected = np.hypot(mango.design.reading.uncalibrated_gain_percent, drifts / np.sqrt(3.0))
    assert calibrate(mango.report, table).unit.gain_percent == pytest.approx(expected.tolist(), rel=1e-9)


def test_level_forces_are_those_of_the_engine(mango, paper):
    for measured, near in ((mango, 5e-3), (paper, 1e-6)):
        for E in (0.5, 3.5):
            (expected,) = measured.press(E, [1.0])
            assert level_press(measured.measuring(), E)[-1] == pytest.approx(expected, rel=near)


HIGH = "high,0,0.0004\nhigh,100,0.0426\nhigh,200,0.0851\nhigh,300,0.1277\n"


def low_spring(calibrate, report, rows):
    """Return the stiffness [N/mm] of the low spring and its relative error, by rows of weights [g] and deflections."""
    table = f"{TIPS}\n" + "".join(f"low,{row}\n" for row in rows) + HIGH
    unit = calibrate(report, table).unit
    return unit.stiffnesses[0], 0.01 * unit.K_percent[0]


def test_dial_that_hides_the_scatter_widens_the_spring(paper, calibrate):
    """A dial of 0.1 mm shows 30 g and 60 g without scatter: the slope is as open as two rounded numbers leave it."""
    K, relative = low_spring(calibrate, paper.report, [f"{g},{0.01 * g:.1f}" for g in (0, 30, 60)])
    assert pytest.approx(GRAM / 0.01) == K
    spread = np.sqrt(2.0) * 30.0 * GRAM
    assert relative == pytest.approx(0.1 / np.sqrt(12.0) / spread * K, rel=1e-6)


def test_spring_of_few_rows_is_wider_by_student_s_t(paper, calibrate):
    """Residuals 1, -2, 1 um: three rows leave one degree of freedom, whose t is tan(0.475 pi); 2 sigma hold 95 %."""
    K, relative = low_spring(calibrate, paper.report, ["0,0.001000", "50,0.498000", "100,1.001000"])
    deviation = np.sqrt(6e-6) / (np.sqrt(2.0) * 50.0 * GRAM)
    assert relative == pytest.approx(np.tan(0.475 * np.pi) / 2.0 * deviation * K, rel=1e-6)


HEADER = "tip,weight_g,deflection_mm,counts_l,counts_h"
LOADS = (0.0, 10.0, 20.0, 10.0, 0.0)


def counted(K, returns, zeros, cross=0.0):
    """Return weights whose channels show 1000 counts a gram of their tip, and `cross` a gram of the other tip.

    `returns` and `zeros` are what each shows more on the way back, and at last [counts].
    """
    rows = []
    for tip, (name, stiffness) in enumerate(zip(("low", "high"), K, strict=True)):
        for step, load in enumerate(LOADS):
            own = 1000.0 * load + (returns[tip] if step == 3 else 0.0) + (zeros[tip] if step == 4 else 0.0)
            counts = [own, cross * load] if tip == 0 else [cross * load, own]
            rows.append([name, load, f"{load * GRAM / stiffness:.9f}", *(f"{each:.3f}" for each in counts)])
    return text_of(HEADER, rows)


def test_channels_tell_what_comes_back_otherwise_and_what_drifts(paper, calibrate):
    """Of the counts of 20 g: hysteresis is a distance, drift has the sign of the last zero; both straight lines fit."""
    found = calibrate(paper.report, counted(paper.K, (60.0, -100.0), (20.0, -40.0), cross=5.0))
    slopes = np.diag(found.channels.counts_per_N) * 20.0 * GRAM
    assert found.channels.hysteresis_percent == pytest.approx((6000.0 / slopes[0], 10000.0 / slopes[1]), rel=1e-9)
    assert found.channels.drift_percent == pytest.approx((2000.0 / slopes[0], -4000.0 / slopes[1]), rel=1e-9)
    assert found.channels.crosstalk_percent == pytest.approx([0.5, 0.5], rel=0.01)
    for tip, name in enumerate(("low", "high")):
        loads = np.array(LOADS) * GRAM
        shown = 1000.0 * np.array(LOADS) + np.array([0, 0, 0, (60, -100)[tip], (20, -40)[tip]])
        slope, zero = np.polyfit(loads, shown, 1)
        left = (
            np.linalg.norm(shown - zero - slope * loads) / np.sqrt(3.0) * 3.182446 / 2.0
        )  # Student's t of three degrees of freedom
        of_slope = np.hypot(left, 1e-3 / np.sqrt(12.0)) / np.linalg.norm(loads - loads.mean()) / slope
        by_return = 0.5 * 0.01 * found.channels.hysteresis_percent[tip] / np.sqrt(3.0)
        assert found.unit.gain_percent[tip] == pytest.approx(100.0 * np.hypot(of_slope, by_return), rel=1e-6), name


def test_counts_that_creep_come_back_as_of_one_time(paper, calibrate):
    """Each weight is read twice, and the counts grow by 3 % in a decade: that is creep and no hysteresis."""
    rows = []
    for tip, (name, K) in enumerate(zip(("low", "high"), paper.K, strict=True)):
        for load, t in ((0, 3), (10, 3), (10, 30), (20, 3), (20, 30), (0, 3)):
            shown = load * t ** np.log10(1.03)
            counts = [f"{5000.0 * shown * (tip == own):.2f}" for own in range(2)]
            rows.append([name, load, t, f"{shown * GRAM / K:.9f}", *counts])
    found = calibrate(paper.report, text_of(HEADER.replace("deflection", "t_s,deflection"), rows))
    assert found.unit.creep_per_decade == pytest.approx(0.03, rel=1e-4)
    assert max(found.channels.hysteresis_percent) < 0.001


def test_counts_of_another_tip_are_judged_over_the_span_of_their_own(paper, calibrate, tmp_path):
    """Half a per cent of a channel is no odd row, two per cent are, however little the others of that tip show."""
    lines = counted(paper.K, (0.0, 0.0), (0.0, 0.0), cross=1.0).splitlines()
    for percent, refused in ((0.5, False), (2.0, True)):
        cells = lines[3].split(",")
        cells[4] = f"{200.0 * percent:.3f}"
        table = "\n".join([*lines[:3], ",".join(cells), *lines[4:]])
        if not refused:
            calibrate(paper.report, table)
            continue
        told = refusal(calibrate, paper.report, table)
        assert told.field == f"{tmp_path / 'measured.csv'}, line 4, column 'counts_h'"
