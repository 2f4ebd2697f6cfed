"""Firmware compiled by the system's compiler, or run by the interpreter, reads as `pipeline read` does."""

import math
import runpy
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from cad.theory.pair_line import PressSums, line_of_sums
from pipeline.measure.unit.firmware import c_header, micropython
from pipeline.measure.unit.fruit_reading import IN_FIRMWARE
from pipeline.measure.unit.presses import reading_of
from pipeline.measure.unit.signals import Signal
from solve.contact.poses import Pose

BITS = {flag: 1 << place for place, flag in enumerate(IN_FIRMWARE)}
AGREES = 1e-5
FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2")
FACTORS = {"mango": (1.19, 1.11, 1.15, 1.12), "paper": (1.19, 1.11)}

SQUARE_MAIN = """
#include <stdio.h>
#include "unit.h"
int main(void)
{
    float f[TWINTIP_TIPS];
    while (fread(f, sizeof f, 1, stdin) == 1) {
        const twintip_reading found = twintip_read(f);
        printf("%.9g %.9g %u\\n", (double)found.E, (double)found.E_reduced, (unsigned)found.flags);
    }
    return 0;
}
"""
PAIR_MAIN = """
#include <stdio.h>
#include "unit.h"
int main(void)
{
    float f[TWINTIP_TIPS];
    twintip_press press;
    twintip_begin(&press);
    while (fread(f, sizeof f, 1, stdin) == 1) {
        if (f[0] == -1000.0f) {
            const twintip_reading found = twintip_end(&press);
            printf("%.9g %.9g %u\\n", (double)found.E, (double)found.lead, (unsigned)found.flags);
            twintip_begin(&press);
        } else {
            printf("add %u\\n", (unsigned)twintip_add(&press, f));
        }
    }
    return 0;
}
"""


def compiled(folder, sensor, main):
    """Return a function that runs the firmware of a unit on rows of forces and returns the lines that it prints."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    (folder / "unit.h").write_text(c_header(sensor), encoding="utf-8")
    (folder / "main.c").write_text(main, encoding="utf-8")
    made = folder / "read"
    subprocess.run(
        [compiler, *FLAGS, str(folder / "main.c"), "-o", str(made), "-lm"], check=True, cwd=folder, timeout=600
    )

    def lines(rows):
        content = np.asarray(rows, dtype=np.float32).tobytes()
        done = subprocess.run([made], input=content, capture_output=True, check=True, timeout=600)
        return done.stdout.decode().splitlines()

    return lines


def module_of(folder, sensor):
    path = folder / "unit.py"
    path.write_text(micropython(sensor), encoding="utf-8")
    return runpy.run_path(str(path))


def over_the_range(mango, rng):
    poses = [
        Pose(E=E, travel=0.5, tilt_deg=tuple(rng.uniform(-2.0, 2.0, 2))) for E in np.geomspace(0.5, 3.5, 200).tolist()
    ]
    return mango.forces(poses, FACTORS["mango"]).astype(np.float32)


def at_random(rng, tips):
    """Return forces, many of them no sensible ones: NaN, infinite, negative, huge, zero."""
    rows = rng.uniform(-0.2, 1.5, (1000, tips)) * 10.0 ** rng.uniform(-2.0, 0.5, (1000, tips))
    odd = np.array([math.nan, math.inf, -math.inf, -1.0, 1e30, 0.0, -0.0])
    chosen = rng.random(rows.shape) < 0.1
    rows[chosen] = rng.choice(odd, chosen.sum())
    return rows.astype(np.float32)


def bits(flags):
    return sum(BITS.get(flag, 0) for flag in flags)


def test_c_of_a_square_agrees_over_the_range(mango, rng, tmp_path):
    sensor = mango.measuring(FACTORS["mango"])
    run, rows = compiled(tmp_path, sensor, SQUARE_MAIN), over_the_range(mango, rng)
    found = np.array([line.split() for line in run(rows)], dtype=float)
    expected = np.array([reading_of(sensor, row).E for row in rows.tolist()])
    assert np.abs(found[:, 0] / expected - 1.0).max() < AGREES
    assert np.abs(found[:, 1] / sensor.reduced(1.0) / expected - 1.0).max() < AGREES


def test_flags_of_c_and_micropython_agree_on_odd_forces(mango, rng, tmp_path):
    sensor = mango.measuring(FACTORS["mango"])
    run, module, rows = compiled(tmp_path, sensor, SQUARE_MAIN), module_of(tmp_path, sensor), at_random(rng, 4)
    expected = [bits(reading_of(sensor, row).flags) for row in rows.tolist()]
    assert [int(line.split()[2]) for line in run(rows)] == expected
    assert [module["read"](row)[2] for row in rows.tolist()] == expected
    assert set(expected) >= {0, 2, 3, 4}


def test_micropython_of_a_square_agrees_over_the_range(mango, rng, tmp_path):
    sensor = mango.measuring(FACTORS["mango"])
    module = module_of(tmp_path, sensor)
    for row in over_the_range(mango, rng).tolist():
        E, reduced, flags = module["read"](row)
        expected = reading_of(sensor, row)
        assert (E, reduced) == pytest.approx((expected.E, expected.reduced), rel=1e-12)
        assert flags == bits(expected.flags)


def presses(paper, sensor, rng):
    """Return presses at moduli over the range, with leads and the noise of the channels."""
    for E in np.geomspace(0.5, 3.5, 12).tolist():
        tilt = (float(rng.uniform(-1.0, 1.0)), 0.0)
        forces = paper.forces([Pose(E=E, travel=x, tilt_deg=tilt) for x in np.linspace(0.3, 0.6, 12)], FACTORS["paper"])
        yield (forces + np.array(sensor.noises) * rng.normal(size=forces.shape)).astype(np.float32)


def test_firmware_of_a_pair_agrees_over_the_range(paper, rng, tmp_path):
    sensor = paper.measuring(FACTORS["paper"])
    run, module = compiled(tmp_path, sensor, PAIR_MAIN), module_of(tmp_path, sensor)
    for press in presses(paper, sensor, rng):
        sums, other = PressSums(), module["Press"]()
        for soft, stiff in press.tolist():
            sums = sums.joined(PressSums(1, soft, stiff))
            assert other.add((soft, stiff)) == 0
        expected = line_of_sums(sensor.C, sensor.report.read_out.own_less_other_per_mm, sums, sensor.noises)
        *added, last = run([*press.tolist(), [-1000.0, 0.0]])
        assert set(added) == {"add 0"}
        assert float(last.split()[0]) == pytest.approx(expected.modulus, rel=AGREES)
        assert float(last.split()[1]) == pytest.approx(expected.lead, abs=1e-5)
        assert other.read()[0] == pytest.approx(expected.modulus, rel=1e-9)


def test_flags_of_a_pair_agree_on_odd_forces(paper, rng, tmp_path):
    sensor = paper.measuring(FACTORS["paper"])
    run, module, rows = compiled(tmp_path, sensor, PAIR_MAIN), module_of(tmp_path, sensor), at_random(rng, 2)
    expected = [bits(set(reading_of(sensor, row).flags) & {"bad_force", "lift_off"}) for row in rows.tolist()]
    assert [int(line.split()[1]) for line in run(rows)] == expected
    assert [module["Press"]().add(row) for row in rows.tolist()] == expected
    assert run([[-1000.0, 0.0]]) == ["nan 0 2"]


@pytest.mark.parametrize("count", [0, 1])
def test_firmware_of_few_level_rows_agrees(count, mango, rng, tmp_path):
    """One row shifts every modulus alike, none shifts nothing."""
    sensor = mango.measuring()
    read_out = replace(sensor.report.read_out, level=sensor.report.read_out.level[:count])
    sensor = replace(sensor, report=replace(sensor.report, read_out=read_out))
    rows = over_the_range(mango, rng)[:5]
    expected = [reading_of(sensor, row).E for row in rows.tolist()]
    module, run = module_of(tmp_path, sensor), compiled(tmp_path, sensor, SQUARE_MAIN)
    assert [module["read"](row)[0] for row in rows.tolist()] == pytest.approx(expected, rel=1e-12)
    assert [float(line.split()[0]) for line in run(rows)] == pytest.approx(expected, rel=AGREES)


def test_planted_constant_is_seen(mango, rng, tmp_path):
    """Firmware of the unit as designed is not that of the unit as printed."""
    sensor, designed = mango.measuring(FACTORS["mango"]), mango.measuring()
    module = module_of(tmp_path, designed)
    row = over_the_range(mango, rng)[100].tolist()
    assert abs(module["read"](row)[0] / reading_of(sensor, row).E - 1.0) > 0.1


def test_signal_of_forces_reads_like_the_forces(mango, rng):
    """A row of a file is the reading of `--forces`: one path, whatever the source."""
    from pipeline.measure.unit.presses import readings_of

    row = over_the_range(mango, rng)[50].tolist()
    text = "t_s,F_1_N,F_2_N,F_3_N,F_4_N\n0," + ",".join(map(repr, row)) + "\n"
    sensor = mango.measuring()
    (reading,) = readings_of(sensor, Signal(text.splitlines(), "-", 4))
    assert reading.E == reading_of(sensor, row).E
