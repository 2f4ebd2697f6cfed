"""Readings of a pair at large strain: of forces that the solver gives, whose balance and interpolation are its own."""

from dataclasses import replace

import numpy as np
import pytest
from measured_units import EXACT, PAPER, MeasuredDesign
from stand_ins import INFO

from cad.quantity import InputError
from cad.theory.soft_tissue import large_strain_factor
from cad.theory.two_spring_law import curve_nonlinearity, curve_shares
from pipeline.measure.calibrating.unit_table import unit_table
from pipeline.measure.calibrating.unit_verdicts import unit_verdicts
from pipeline.measure.unit.deep_pair import Samples
from pipeline.measure.unit.deep_reading import other_laws
from pipeline.measure.unit.firmware import c_header
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.pair_press import PairPress, single_reading
from pipeline.report.stored import StoredDepth
from solve.contact.large_response import large_response
from solve.contact.scene import Scene
from solve.large_strain.force_curve import ForceCurve

TRAVELS = np.linspace(0.03, 0.6, 40)
DEPTHS = (0.003, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
# Of log neo-Hooke at nu = 0.45, sharp, no slip, by an independent program, over its start.
FACTORS = tuple(np.array([1.0027, 0.9964, 0.9894, 0.9798, 0.9723, 0.9659, 0.9609, 0.9547]) / 1.0027)
CURVE = ForceCurve(depths=DEPTHS, factors=FACTORS, errors=(2e-3,) * 8, grip=1.0, asked=0.6, info=INFO)


class DeepDesign(MeasuredDesign):
    """The paper's sensor on flesh at large strain, whose curve is given."""

    def __init__(self):
        super().__init__("paper")
        design = replace(self.design, press=replace(self.design.press, strain="large"))
        depths = np.linspace(DEPTHS[0], DEPTHS[-1], 61)
        rows = zip(depths.tolist(), CURVE.factor(depths).tolist(), strict=True)
        table = tuple(StoredDepth(depth_sides=depth, factor=g, error_percent=0.5) for depth, g in rows)
        self.report = replace(self.report, design=design, read_out=replace(self.report.read_out, large_strain=table))
        self.scene = Scene(fruit=design.fruit, tips=design.tips, press=design.press)

    def press(self, E, lead=0.0, curve=CURVE, travels=TRAVELS):
        """Return forces [N] over travels, (travels, tips); the low tip stands back by a lead [mm]."""
        scene = replace(self.scene, height_offset_mm=(-lead, 0.0) if lead else ())
        return large_response(scene, self.contact, self.C, curve, ([E], travels)).F[0]


@pytest.fixture(scope="module")
def deep():
    return DeepDesign()


def read(sensor, forces):
    found = PairPress(sensor)
    for soft, stiff in forces.tolist():
        if min(soft, stiff) > 0.0:
            found.add(soft, stiff)
    return found.reading()


@pytest.mark.parametrize("E", [0.5, 1.3, 3.5])
def test_level_press_is_read_by_line_and_by_ratio(deep, E):
    forces = deep.press(E)
    reading = read(deep.measuring(), forces)
    assert pytest.approx(E, rel=1e-4) == reading.E
    assert reading.others["force_ratio"] == pytest.approx(E, rel=1e-4)
    assert reading.flags == ()
    assert pytest.approx(E, rel=1e-4) == single_reading(deep.measuring(), forces[-1].tolist()).E


def test_linear_law_would_be_off(deep):
    """What large strain is read for: the linear law reads this press 6 % low, the line even lower."""
    linear = MeasuringUnit(
        report=replace(deep.report, read_out=replace(deep.report.read_out, large_strain=())), unit=deep.measuring().unit
    )
    found = read(linear, deep.press(1.0))
    assert 0.03 < 1.0 - found.others["force_ratio"] < 0.09
    assert found.others["force_ratio"] > found.E


@pytest.mark.parametrize("E", [0.5, 1.0])
@pytest.mark.parametrize("lead", [-0.1, -0.05, 0.05, 0.1])
def test_line_reads_through_a_lead(deep, E, lead):
    """Also where the force ratio tells no modulus, as under a lead of -0.1 mm."""
    reading = read(deep.measuring(), deep.press(E, lead=lead))
    assert pytest.approx(E, rel=1e-3) == reading.E
    assert reading.tilt == pytest.approx(np.degrees(np.arctan(abs(lead) / 8.0)), rel=0.02)
    assert "out_of_range" not in reading.flags
    assert ("force_ratio" in reading.others) == (lead > -0.1)
    # At -0.05 mm and 0.5 MPa the ratio hardly changes with the modulus: its noise explains the difference.
    assert "read_outs_disagree" in reading.flags or (E, lead) == (0.5, -0.05)


def test_flesh_of_another_law_is_inside_the_uncertainty(deep):
    for name, law in other_laws(deep.measuring(), deep.measuring().deep).items():
        factors = tuple(np.interp(DEPTHS, law.depths, law.factors).tolist())
        reading = read(deep.measuring(), deep.press(1.0, curve=replace(CURVE, factors=factors)))
        assert abs(reading.E - 1.0) > 0.01
        assert abs(reading.E - 1.0) < reading.u * reading.E
        assert reading.others[name] == pytest.approx(1.0, rel=2e-3)


BENT = [np.ones(8), np.linspace(-1.0, 1.0, 8), np.sign(np.array(DEPTHS) - 0.25)]


@pytest.mark.parametrize("bent", BENT)
def test_curve_anywhere_within_its_bar_is_inside_what_it_adds_to_the_uncertainty(deep, bent):
    """Flesh whose curve is off alike, tilted or turned, each by the bar of 0.5 %, read by the curve of the report."""
    sensor, exact = deep.measuring(), MeasuringUnit(report=without_bars(deep.report), unit=deep.measuring().unit)
    forces = deep.press(1.0, curve=replace(CURVE, factors=tuple(np.array(FACTORS) * (1.0 + 0.005 * bent))))
    reading, known = read(sensor, forces), read(exact, forces)
    by_curve = 0.5 * np.sqrt(3.0 * (reading.u**2 - known.u**2))
    assert 0.001 < abs(reading.E - 1.0) < by_curve


def without_bars(report):
    return with_bars(report, 0.0)


def with_bars(report, percent):
    rows = tuple(replace(row, error_percent=percent) for row in report.read_out.large_strain)
    return replace(report, read_out=replace(report.read_out, large_strain=rows))


def test_poisson_s_ratio_moves_the_reading_by_both_ways_it_is_felt(deep):
    """Flesh of another nu answers as E / (1 - nu^2) and bends its curve: both move E, and the second is seen."""
    fruit, spread = deep.design.fruit, 0.02
    sensors = [with_poisson_spread(deep, each) for each in (spread, 0.0)]
    forces = deep.press(1.3)
    reading, known = (read(sensor, forces) for sensor in sensors)
    moved = []
    for nu in (fruit.poisson - spread, fruit.poisson + spread):
        shares = [large_strain_factor(d, nu) / large_strain_factor(d, fruit.poisson) for d in DEPTHS]
        other = replace(CURVE, factors=tuple(np.array(FACTORS) * shares))
        moved.append(1.3 / read(deep.measuring(), deep.press(1.3, curve=other)).E)
    by_curve = 0.5 * (moved[1] - moved[0])
    by_felt = -2.0 * fruit.poisson * spread / (1.0 - fruit.poisson**2)
    assert abs(by_curve) > 0.05 * abs(by_felt)
    said = 0.5 * np.sqrt(reading.u**2 - known.u**2)
    assert said == pytest.approx(abs(by_curve + by_felt), rel=0.03)


def with_poisson_spread(deep, spread):
    """Return the paper's sensor on flesh whose Poisson's ratio is known to a spread."""
    fruit = replace(deep.report.design.fruit, poisson_spread=spread)
    report = replace(deep.report, design=replace(deep.report.design, fruit=fruit))
    return MeasuringUnit(report=report, unit=deep.measuring().unit)


def targets_by_the_solver(deep, curve):
    """Return P_max and NL at mid-range of the sensor on flesh of a curve."""
    moduli = [deep.design.fruit.E_max_MPa * share for share in curve_shares(2)]
    low, high = np.transpose([deep.press(E, curve=curve, travels=TRAVELS[-1:])[0] for E in moduli])
    P = (high / low).tolist()
    return P[-1], curve_nonlinearity(P, moduli, "mid-range")


@pytest.mark.parametrize("bent", BENT)
def test_verdicts_of_a_unit_hold_the_curve_in_their_error(deep, bent):
    """P_max with any curve within its bar, NL with one that is off alike at all depths; springs known exactly."""
    P, NL = unit_verdicts(deep.measuring(), ())
    true = targets_by_the_solver(deep, replace(CURVE, factors=tuple(np.array(FACTORS) * (1.0 + 0.005 * bent))))
    assert 0.002 < abs(P.value - true[0]) <= P.error
    if bent.min() > 0.0:
        assert 1e-5 < abs(NL.value - true[1]) <= NL.error
    sure = MeasuringUnit(report=without_bars(deep.report), unit=deep.measuring().unit)
    assert [verdict.error for verdict in unit_verdicts(sure, ())] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert targets_by_the_solver(deep, CURVE) == pytest.approx([P.value, NL.value], rel=1e-4)


def test_curve_that_is_too_uncertain_leaves_the_unit_open(deep):
    """No more readings of the springs would help; and the table says that its error counts the curve."""
    loose = MeasuringUnit(report=with_bars(deep.report, 5.0), unit=deep.measuring().unit)
    P, _ = unit_verdicts(loose, ())
    assert P.passed is None
    assert P.remedy.startswith("press less deep: the curve of a tip leaves 0.2")
    wide, narrow = (unit_table(sensor, sensor)[0].u for sensor in (loose, deep.measuring()))
    assert wide == pytest.approx(10.0 * narrow)


def test_springs_and_gains_move_the_reading_as_is_said(deep):
    forces = deep.press(1.3)
    plain = read(deep.measuring(), forces)
    for tip in range(2):
        factors = np.ones(2)
        factors[tip] = 1.001
        moved = read(deep.measuring(factors), forces).E / plain.E - 1.0
        known = read(deep.measuring(), forces).u
        alone = np.full(2, EXACT)
        alone[tip] = 1.0
        unit = deep.measuring().unit
        open_spring = MeasuringUnit(report=deep.report, unit=replace(unit, K_percent=tuple(alone.tolist())))
        wider = read(open_spring, forces).u
        assert np.sqrt(wider**2 - known**2) == pytest.approx(2.0 * 10.0 * abs(moved), rel=0.03)


def test_noise_is_as_said(deep, rng):
    sensor, forces = deep.measuring(), deep.press(1.3)
    found = [sensor.deep.line(_samples(forces + rng.normal(0.0, sensor.noises, forces.shape)), sensor.noises)
             for _ in range(30)]  # fmt: skip
    E = np.array([line.modulus for line in found])
    assert abs(E.mean() - 1.3) < 3.0 * E.std() / np.sqrt(len(E))
    assert E.std() / 1.3 == pytest.approx(found[0].error, rel=0.4)  # of 30 draws: 13 % one sigma


def _samples(forces):
    return Samples(np.ones(len(forces)), forces)


def test_press_deeper_than_was_solved_is_flagged_and_far_deeper_refused(deep):
    longer = replace(CURVE, depths=(*DEPTHS[:-1], 1.5), asked=1.5)
    found = {travel: read(deep.measuring(), deep.press(0.5, curve=longer, travels=np.linspace(0.05, travel, 40)))
             for travel in (0.7, 1.2)}  # fmt: skip
    assert "deeper_than_solved" in found[0.7].flags
    assert (found[1.2].E, found[1.2].flags) == (None, ("out_of_range", "deeper_than_solved"))


def test_forces_of_no_fruit_tell_no_modulus(deep):
    forces = deep.press(1.3)[:, ::-1]
    assert read(deep.measuring(), forces).E is None
    assert single_reading(deep.measuring(), forces[-1].tolist()).flags == ("out_of_range",)


def test_level_forces_are_those_of_the_solver(deep):
    for E in (0.5, 3.5):
        found = deep.measuring().deep.forces(E, 0.6)
        np.testing.assert_allclose(found, deep.press(E, travels=np.array([0.6]))[0], rtol=1e-5)
    assert PAPER == (906.0, 20830.0)


def test_firmware_is_refused_by_name(deep):
    with pytest.raises(InputError, match=r"press\.strain = 'large': must be 'linear' for firmware"):
        c_header(deep.measuring())
