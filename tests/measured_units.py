"""Reports of designs as `pipeline read` takes them, without a run; and units of them in random poses."""

import math
import shutil
import subprocess
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

from cad.parts.housing import Housing
from instrument.firmware.firmware import render_header, render_module
from instrument.press.contrast_press import press_reading
from instrument.press.fruit_reading import FruitReading
from instrument.press.measuring import MeasuringUnit
from instrument.press.one_time import simultaneous_samples
from instrument.press.presses import readings_of
from instrument.press.printed_unit import unit_of
from instrument.press.signals import Sample, Signal, force_keys
from instrument.press.touches import PressSamples, split_presses
from pipeline.options import RunOptions, load_design
from pipeline.reading.analysis import analyse_readings, reading_constants
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.reading.read_out import ReadingConstants
from pipeline.report.parts import ContactReport, ModulusReport, ReadingReport, TipReport
from pipeline.response.contact import fruit_compliance
from pipeline.response.scene_press import scene_of
from pipeline.springs.fitted_springs import springs_for
from pipeline.springs.sizing import spring_sizing
from pipeline.tables.rows import Rows
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements
from sensor.theory.creep import CreepLaw
from solve.contact.linear_response import spring_compliance
from solve.contact.pose_forces import Pose, Stand, pose_forces
from solve.contact.scene import LateralCompliance
from solve.fruit.compliance import FruitCompliance
from tests.deadline import DEADLINE_S

C_FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O0")  # quickly compiled: tests of clients optimise
READ_IN_C = """
#include <stdio.h>
#include "unit.h"
int main(void)
{
    float f[TWINTIP_TIPS];
    twintip_press press;
    twintip_begin(&press);
    while (fread(f, sizeof f, 1, stdin) == 1) {
        printf("0 0 %u 0\\n", (unsigned)twintip_add(&press, f));
    }
    const twintip_reading found = twintip_end(&press);
    printf("%.9g %.9g %u %u\\n", (double)found.E, (double)found.E_reduced, (unsigned)found.flags,
           (unsigned)found.left_out);
    return 0;
}
"""
IN_FIRMWARE = (
    *("bad_force", "lift_off", "out_of_range", "saturated", "not_tared", "few_samples", "no_rise", "too_fast"),
    "presses_disagree",
)
"""Flags of firmware, from bit 0 on: programs of users know them by number."""
EXACT = 1e-9  # [%] of springs that are known
SHARES = np.linspace(0.025, 1.0, 40)  # of the full travel, in a press
PAPER = (906.0, 20830.0)  # [N/m] springs that its targets size
ACROSS = (0.76, 0.21)  # [mm/N] of low and high domes of the mango across their plates


@dataclass(frozen=True, kw_only=True)
class ReportOfUnits:
    """What measuring takes of a `Report`."""

    design: Design
    tips: tuple[TipReport, ...]
    contact: ContactReport
    compliance: FruitCompliance
    read_out: ReadingConstants
    moduli: tuple[ModulusReport, ...]
    reading: ReadingReport | None = None
    housing: Housing | None = None

    @property
    def creep(self) -> CreepLaw:
        """Return the creep of printed leaves."""
        return self.design.process.creep


class MeasuredDesign:
    """A design with its contact and springs: its stored report, and the forces of its units on fruit."""

    def __init__(self, name, *, assessed=True, reading=None, **settings):
        """Solve the contact, and assess the readings where the design asks for them."""
        self.design = load_design(name, settings)
        if reading is not None:
            self.design = replace(self.design, reading=ReadingRequirements(**reading))
        design = self.design
        self.contact = fruit_compliance(design, RunOptions())
        given = design.springs
        kinds = [given.K_l_N_per_m, given.K_h_N_per_m] if given.given else PAPER
        self.K = np.array(design.tips.each(*(1e-3 * K for K in kinds)))
        self.C = spring_compliance(*self.K)
        self.sideways = None
        if design.tips.tip_shape.obeys_hertz:
            give = np.zeros((len(self.K), len(self.K), 3, 3))
            give[range(len(self.K)), range(len(self.K)), 1, 1] = design.tips.each(*ACROSS)
            self.sideways = LateralCompliance(give, 0.0)
        sizing = spring_sizing(design, self.contact, RunOptions())
        ideal = springs_for(design, sizing, "sized")
        springs = SimpleNamespace(**{**vars(ideal), "C": self.C, "sideways": self.sideways, "creep": ideal.creep})
        self.sensor = PressedSensor(design=design, contact=self.contact, sizing=sizing, springs=springs)
        readings = analyse_readings(self.sensor) if assessed else None
        level = self.forces([Pose(E=design.fruit.largest_E_MPa, travel=design.press.travel_mm)])
        press = SimpleNamespace(at_largest_E=SimpleNamespace(F=level[None]))
        read_out = reading_constants(self.sensor, press, readings)
        self.report = ReportOfUnits(
            design=design,
            tips=TipReport.rows(design.tips),
            contact=ContactReport.from_stage(self.contact),
            compliance=self.contact,
            read_out=read_out,
            moduli=() if readings is None else ReadingReport.from_stage(readings).moduli,
            reading=None if readings is None else ReadingReport.from_stage(readings),
        )

    def forces(self, poses, factors=1.0):
        """Return the forces [N] of a unit whose springs are stiffer by factors in poses, (poses, tips)."""
        share = 1.0 / np.sqrt(np.broadcast_to(factors, self.K.shape))
        scene = scene_of(self.design, (), self.sideways)
        return pose_forces(scene, self.contact, share[:, None] * self.C * share, poses).F

    def press(self, E, shares=SHARES, factors=1.0, **stand):
        """Return the forces [N] at shares of the full travel of one press, (samples, tips)."""
        travels = (np.asarray(shares) * self.design.press.travel_mm).tolist()
        return self.forces([Pose(E=E, travel=x, stand=Stand(**stand)) for x in travels], factors)

    def measuring(self, factors=1.0, percent=EXACT, gain_percent=0.0, classes=None):
        """Return a unit that takes its springs for stiffer by factors than designed; they do not creep."""
        count = len(self.K)
        stiffnesses = (self.K * factors * np.ones(count)).tolist()
        unit = unit_of(self.report, stiffnesses=stiffnesses, percent=(percent,) * count, method="test")
        unit = replace(elastic(unit), gain_percent=(gain_percent,) * count)
        return MeasuringUnit(report=self.report, unit=unit, classes=classes)


def elastic(unit):
    """Return a unit whose springs do not creep."""
    return replace(unit, creep_per_decade=0.0, creep_error=0.0)


def read_press(sensor, forces):
    """Return what a unit reads of a press, from forces [N] (samples, tips)."""
    return press_reading(sensor, PressSamples.of_forces(np.asarray(forces, dtype=float)))


def read_log(sensor, rows):
    """Return what the command reads of one press, or of the deepest, in rows that come at the rate of the read-out.

    As firmware does, it takes the press for one of the duration of the design.
    """
    signal = sensor.report.read_out.signal
    period = 1.0 / (signal.rate_Hz if signal else 10.0)
    samples = (Sample(number, number * period, tuple(row)) for number, row in enumerate(rows.astype(float)))
    timing, samples = simultaneous_samples(sensor, samples, "press.csv")
    in_newtons = (row._replace(forces=tuple(sensor.forces_of_channels(row.forces).tolist())) for row in samples)
    presses = split_presses(sensor, in_newtons, "press.csv", timing.lag)
    deepest = max(presses, key=lambda press: press.forces.sum(axis=1).max(), default=None)
    if deepest is None:
        return FruitReading(flags=("lift_off",))
    return press_reading(sensor, replace(deepest, touched_s=np.nan), timing)


def text_of(head, rows):
    """Return a table as text; `head` are its labels with commas between."""
    return "\n".join([head, *(",".join(map(str, row)) for row in rows)])


GRAM = 9.80665e-3  # [N]


def weighed(names, loads, shown, counts=lambda _: ()):
    """Return the rows of weights on each tip in turn: its name, load [g], deflection [mm] and counts.

    `loads` [N] are those of each tip. `shown` takes a tip and its load, `counts` the forces of all tips [N].
    """
    rows = []
    for tip, (name, of_tip) in enumerate(zip(names, loads, strict=True)):
        for load in of_tip:
            rows.append([name, load / GRAM, shown(tip, load), *counts(load * np.eye(len(names))[tip])])
    return rows


def lines_of(times, forces):
    """Return a log of forces [N], (samples, tips), at times [s]."""
    head = ",".join(["t_s", *(f"{key}_N" for key in force_keys(forces.shape[1]))])
    return [head, *(",".join(map(repr, row)) for row in np.column_stack([times, forces]).tolist())]


def readings_at(sensor, times, forces, **how):
    """Return what the command reads of a log of forces [N], (samples, tips), at times [s]."""
    log = Rows(lines_of(times, forces), "press.csv")
    return list(readings_of(sensor, Signal(log, forces.shape[1]), **how))


def with_read_out(sensor, **changed):
    """Return a unit whose report has another read-out."""
    return replace(sensor, report=replace(sensor.report, read_out=replace(sensor.report.read_out, **changed)))


def with_path(sensor, **changed):
    """Return a unit whose read-out has another signal path."""
    return with_read_out(sensor, signal=replace(sensor.report.read_out.signal, **changed))


def with_design(sensor, **changed):
    """Return a unit whose report has another design."""
    return replace(sensor, report=replace(sensor.report, design=replace(sensor.report.design, **changed)))


def with_heights(sensor, heights):
    """Return a unit whose report says that each tip stands out by so much more [mm]."""
    gaps = np.subtract(sensor.report.read_out.gaps_mm, heights)
    return with_read_out(sensor, gaps_mm=tuple(gaps.tolist()))


def with_exact_tips(sensor):
    """Return a unit of a process that makes tips as high as designed."""
    process = replace(sensor.report.design.process, name="exact", accuracy_mm=1e-6)
    return with_design(sensor, print=replace(sensor.report.design.print, process=process.name), printer=process)


def stated_and_moved(sensor, forces, read, field, tip):
    """Return what one per cent of a spring or a gain adds to the uncertainty of a reading, and how far it moves E.

    `read` takes a unit and forces; the second is twice what a spring or a gain that is off by a thousandth does, times
    ten. Channels that were calibrated on a plate show forces by the spring.
    """
    factors = np.ones(len(sensor.report.tips))
    factors[tip] = 1.001
    plain = read(sensor, forces)
    is_spring = field == "K_percent"
    shown = forces if is_spring and sensor.unit.calibrated_by == "weights" else forces * factors
    off = read(sensor.with_stiffness(tip, 1.001) if is_spring else sensor, shown)
    percent = np.full(len(factors), EXACT)
    percent[tip] = 1.0
    unit = replace(sensor.unit, **{field: tuple(percent.tolist())})
    wider = read(replace(sensor, unit=unit), forces).u
    return np.sqrt(wider**2 - plain.u**2), 2.0 * 10.0 * abs(off.E / plain.E - 1.0)


def random_pose(design, rng, E, travel):
    """Return a pose at random, at a travel from its first touch, among those that a design's [reading] allows."""
    asked = design.reading
    tilt, place = (
        length * np.sqrt(rng.random()) * np.array([np.cos(angle), np.sin(angle)])
        for length, angle in zip((asked.tilt_deg, asked.off_centre_mm), rng.uniform(0.0, 2.0 * np.pi, 2), strict=True)
    )
    fruit = {}
    if asked.radius_mm is not None:
        fruit["radii_mm"] = (rng.uniform(*asked.radius_mm), rng.uniform(*asked.radius_across_mm))
        fruit["azimuth_deg"] = rng.uniform(0.0, 180.0)
    elif design.fruit.radius_mm is not None and asked.radius_spread > 0.0:
        radius = design.fruit.radius_mm * (1.0 + asked.radius_spread * rng.uniform(-1.0, 1.0))
        fruit["radii_mm"] = (radius, radius)
    if asked.thickness_mm is not None:
        fruit["thickness_mm"] = rng.uniform(*asked.thickness_mm)
    return Pose(
        E=E, travel=travel, stand=Stand(tilt_deg=tuple(tilt), off_centre_mm=tuple(place), from_touch=True, **fruit)
    )


def printed_by_header(folder, sensor, program, rows):
    """Return the numbers that a C program prints with the header of a unit, fed rows of numbers; skips without C."""
    key = (render_header(sensor), program)
    if key not in _COMPILED:
        _COMPILED[key] = _compiled(folder, *key)
    command = _COMPILED[key]
    out = subprocess.run([command], input=rows.tobytes(), capture_output=True, check=True, timeout=DEADLINE_S).stdout
    return np.array([line.split() for line in out.decode().splitlines()], dtype=float)


_COMPILED = {}
"""Programs by header and source: folders of tests stay until the session ends."""


def _compiled(folder, header, program):
    """Return the path of a program that is compiled with a header, in a folder of its own below a test's."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    place = folder / f"c-{len(_COMPILED)}"
    place.mkdir()
    (place / "unit.h").write_text(header, encoding="utf-8")
    (place / "main.c").write_text(program, encoding="utf-8")
    subprocess.run([compiler, *C_FLAGS, "main.c", "-o", "read", "-lm"], check=True, cwd=place, timeout=DEADLINE_S)
    return place / "read"


class FirmwareReading(NamedTuple):
    """What firmware reads of a press: moduli [MPa], nan if none, its flags, and how many samples it left out."""

    E: float
    reduced: float
    flags: int
    left_out: int


def bits(flags):
    """Return the flags of a reading as firmware has them."""
    return sum(1 << IN_FIRMWARE.index(flag) for flag in flags if flag in IN_FIRMWARE)


def as_firmware(reading):
    """Return a reading of the command as firmware tells it."""
    moduli = (math.nan if E is None else E for E in (reading.E, reading.reduced))
    return FirmwareReading(*moduli, bits(reading.flags), len(reading.lines_left_out))


def module_of(sensor):
    """Return the names of the MicroPython module of a unit."""
    names = {"__name__": "unit"}
    exec(render_module(sensor), names)
    return names


def read_by_module(sensor, rows):
    """Return what the MicroPython module of a unit reads of a press of forces [N], (samples, tips)."""
    press = module_of(sensor)["Press"]()
    for row in rows.astype(float).tolist():
        press.add(row)
    E, reduced, flags = press.read()
    return FirmwareReading(E or math.nan, reduced or math.nan, flags, press.left_out)


def read_in_c(folder, sensor, rows):
    """Return what the firmware of a unit reads of a press of forces [N], (samples, tips); skips without C."""
    *_, found = printed_by_header(folder, sensor, READ_IN_C, np.asarray(rows, dtype=np.float32)).tolist()
    return FirmwareReading(*found)
