"""The programs of `pipeline read --logger` on an emulated board with an emulated ADS1220, wired as wiring.svg shows."""

import copy
import itertools
import re
import shutil
import subprocess
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from deadline import DEADLINE_S
from emulated_board import GREATEST, STUBS, Board, Chip, board_pins, run_on_arduino, run_on_pico, wires_of
from refusal import refusal

from cad.fabrication.wiring import write_wiring
from instrument.firmware.firmware import render_board_files
from instrument.press.measuring import MeasuringUnit
from instrument.press.presses import readings_of
from instrument.press.signals import Signal
from pipeline.tables.rows import Rows
from sensor.design.readout import Readout

AGREES = 1e-5  # single precision
PROGRAMS = ("main.py", "sketch/sketch.ino")
LEVELS = (0.5, -0.012345, 0.9999999, 3e-7)  # of the supply: usual, below ground, the largest and one of few counts
COUNTS = [round(level * 2**23) for level in LEVELS]
DRIFTS = (1e-4, -2e-4, 0.0, 1e-6)  # of the supply in a second, of which a conversion sees its own time
OFFSETS = 3.3e6  # counts of a free sensor: half of the supply is 2^22


@pytest.fixture(scope="module")
def pair(paper):
    """Return the pair with a read-out."""
    design = replace(paper.design, readout=Readout())
    sensor = replace(paper.sensor, design=design)
    measured = copy.copy(paper)
    measured.report = replace(
        paper.report, design=design, read_out=replace(paper.report.read_out, signal=sensor.signal)
    )
    return measured


@pytest.fixture
def wiring(tmp_path):
    """Return a function that draws the wiring plan of a design, and returns the pins and the inputs that it joins."""

    def drawn(measured):
        path = tmp_path / "wiring.svg"
        write_wiring(path, [tip.name for tip in measured.report.tips], 1, "rp2040")
        inputs = [name for _, name in wires_of(path) if name.startswith("AIN")]
        assert inputs == [f"AIN{index}" for index in range(len(measured.K))]
        return board_pins(path)

    return drawn


@pytest.fixture
def printed(tmp_path, wiring):
    """Return a function that runs a program of a design on a board, and returns what it prints."""
    numbers = itertools.count()

    def run(measured, files, name, chip, seconds):
        board = Board(chip, wiring(measured))
        if name == "main.py":
            return run_on_pico(files[name], board, seconds)
        folder = tmp_path / f"sketch-{next(numbers)}"  # a library that is loaded keeps its place
        folder.mkdir()
        for path, text in files.items():
            (folder / path.rpartition("/")[2]).write_text(text, encoding="utf-8")
        return run_on_arduino(folder, board, seconds)

    return run


def files_of(measured, unit=None):
    sensor = measured.measuring() if unit is None else MeasuringUnit(report=measured.report, unit=unit)
    return render_board_files(sensor, calibrated=unit is not None)


def rows_of_text(text):
    """Return the header and the rows of numbers that a logger printed."""
    header, *lines = text.splitlines()
    return header, [tuple(map(int, line.split(","))) for line in lines]


def drifting(channel, t):
    return LEVELS[channel] + 1e-6 * t * DRIFTS[channel]


@pytest.mark.parametrize("name", PROGRAMS)
def test_logger_prints_the_counts_of_each_channel(name, mango, printed):
    """To the last count, with the time of each sample, at the rate and in the order of the design."""
    signal = mango.report.read_out.signal
    chip = Chip(drifting)
    header, rows = rows_of_text(printed(mango, files_of(mango), name, chip, 1.0))
    assert header == "t_us,counts_1,counts_2,counts_3,counts_4"
    assert chip.faults == []
    times, *counts = np.array(rows).T
    inputs, starts, _ = np.array(chip.conversions).T
    assert inputs[: 4 * len(rows)].tolist() == [8 + tip for tip in signal.conversion_order] * len(rows)
    starts = starts[: 4 * len(rows)].reshape(len(rows), 4)
    for tip, seen in enumerate(counts):
        middles = starts[:, signal.conversion_order.index(tip)] + 0.5 * 23762 / 4.096
        expected = np.clip(np.rint(2**23 * (LEVELS[tip] + 1e-6 * middles * DRIFTS[tip])), -GREATEST - 1, GREATEST)
        assert seen.tolist() == expected.tolist()
    assert len(rows) == pytest.approx(signal.rate_Hz, rel=0.05, abs=1.0)
    after = (starts - times[:, None]) - (starts[0] - times[0])[0]
    delays = 1e3 * np.array(sorted(signal.delay_ms))
    period = 1e6 / signal.rate_Hz
    assert np.abs(after - delays * np.diff(times).mean() / period).max() < 1e3 * signal.time_error_ms


@pytest.mark.parametrize("name", PROGRAMS)
def test_board_waits_for_a_chip_that_does_not_answer_and_goes_on(name, pair, printed):
    """One without supply, and one that stops converting: no row is made up, and times go on."""
    chip = Chip(lambda channel, _: LEVELS[channel])
    chip.answers = False
    files = files_of(pair)
    said = printed(pair, files, name, chip, 2.5)
    assert re.fullmatch(r"(no ADS1220 answers: .+\s+){2,3}", said)
    chip.answers = True
    chip.level = lambda channel, t: setattr(chip, "converts", t % 1e6 < 8e5) or LEVELS[channel]
    said = printed(pair, files, name, chip, 3.0).replace("\r", "")
    rows = [line for line in said.splitlines() if re.fullmatch(r"[\d,-]+", line)]
    times = [int(row.split(",")[0]) for row in rows]
    assert {row.partition(",")[2] for row in rows} == {f"{COUNTS[0]},{COUNTS[1]}"}
    assert times == sorted(times)


HEADERS = {"mango": "t_s,counts_1,counts_2,counts_3,counts_4", "pair": "t_s,counts_l,counts_h"}


@pytest.mark.parametrize(
    ("design", "name"),
    [
        ("mango", PROGRAMS[0]),
        ("pair", PROGRAMS[1]),
        pytest.param("mango", PROGRAMS[1], marks=pytest.mark.slow),
        pytest.param("pair", PROGRAMS[0], marks=pytest.mark.slow),
    ],
)
def test_a_board_reads_the_press_that_its_chip_was_given(name, design, request, printed):
    """E of the program is what the command reads of the same conversions, each channel at its own time.

    How counts of weights become a unit is held beside the counts.
    """
    measured = request.getfixturevalue(design)
    signal, tips = measured.report.read_out.signal, len(measured.K)
    unit = replace(counted(measured), zero_counts=(OFFSETS,) * tips)
    sensor = MeasuringUnit(report=measured.report, unit=unit)
    forces = measured.press(1.4, np.linspace(0.02, 1.0, 60))
    forces = np.concatenate([np.zeros((1, tips)), forces, forces[::-3], np.zeros((1, tips))])
    times = 0.4 + 0.025 * np.arange(len(forces))  # the tare is free

    def level(channel, t):
        if channel >= tips:
            return 0.0
        force = np.interp(1e-6 * t, times, forces[:, channel])
        return float(OFFSETS + signal.counts_per_N[channel] * force) / 2**23

    board = Chip(level)
    said = printed(measured, files_of(measured, unit), name, board, 2.6).replace("\r", "")
    counts = np.array([count for _, _, count in board.conversions])
    counts = counts[: len(counts) // 4 * 4].reshape(-1, 4)[:, np.argsort(signal.conversion_order)]
    lines = [",".join(map(str, [index / signal.rate_Hz, *row])) for index, row in enumerate(counts.tolist())]
    (expected,) = readings_of(sensor, Signal(Rows([HEADERS[design], *lines], "press.csv"), tips))
    assert pytest.approx(1.4, rel=0.03) == expected.E
    (found,) = re.findall(r"^E (\S+) MPa, E/\(1 - nu\^2\) (\S+) MPa, flags 0$", said, flags=re.M)
    digits = {"rel": AGREES} if name == "main.py" else {"abs": 0.6e-4}  # the sketch prints four decimals
    assert list(map(float, found)) == pytest.approx([expected.E, sensor.reduced(expected.E)], **digits)


COMPILERS = {
    "ATmega2560": ("avr-g++", "-mmcu=atmega2560", "-std=gnu++11"),
    "ATmega328P": ("avr-g++", "-mmcu=atmega328p", "-std=gnu++11"),
    "Cortex-M0+": ("arm-none-eabi-g++", "-mcpu=cortex-m0plus", "-mthumb", "-std=gnu++17", "-DARDUINO_ARCH_RP2040"),
    "Cortex-M4F": ("arm-none-eabi-g++", "-mcpu=cortex-m4", "-mthumb", "-std=gnu++17"),
    "this machine": ("g++", "-std=gnu++17"),
}


@pytest.mark.parametrize("calibrated", [False, True])
@pytest.mark.parametrize("board", COMPILERS)
def test_sketch_compiles_without_a_warning(board, calibrated, mango, tmp_path):
    compiler, *flags = COMPILERS[board]
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    for path, text in files_of(mango, counted(mango) if calibrated else None).items():
        (tmp_path / path.rpartition("/")[2]).write_text(text, encoding="utf-8")
    words = ["-Wall", "-Wextra", "-Werror", "-Os", f"-I{STUBS}", "-include", "Arduino.h", "-x", "c++", "-c"]
    subprocess.run([compiler, *flags, *words, "sketch.ino"], check=True, cwd=tmp_path, timeout=DEADLINE_S)


def counted(measured):
    """Return a unit of a design whose counts are calibrated, as designed."""
    signal = measured.report.read_out.signal
    matrix = tuple(map(tuple, np.diag(1.0 / np.array(signal.counts_per_N)).tolist()))
    zeros = (0.0,) * len(matrix)
    return replace(
        measured.measuring().unit,
        newtons_per_count=matrix,
        zero_counts=zeros,
        saturation_counts=signal.saturation_counts,
    )


@pytest.mark.parametrize(
    ("readout", "field"),
    [
        (None, "--logger"),
        ({"rate_Hz": 20.0}, "readout.rate_Hz"),
        ({"bits": 16.0}, "readout.bits"),
        ({"full_scale_mV": 2048.0}, "readout.full_scale_mV"),
        ({"delay_ms": (0.0, 1.0, 2.0, 3.0)}, "readout.delay_ms"),
    ],
)
def test_board_that_is_not_known_is_refused(readout, field, mango):
    report = mango.report
    if readout is None:
        report = replace(report, read_out=replace(report.read_out, signal=None))
    else:
        report = replace(report, design=replace(report.design, readout=replace(report.design.readout, **readout)))
    assert refusal(render_board_files, replace(mango.measuring(), report=report), calibrated=False).field == field


def test_unit_without_counts_is_refused(mango):
    assert refusal(render_board_files, mango.measuring(), calibrated=True).field == "--unit"


def test_logger_needs_no_reading(mango):
    """A relaxing fruit is read with its hold, by the command: its counts are logged all the same."""
    design = mango.report.design
    fruit = SimpleNamespace(**{**vars(design.fruit), "relaxation": "any"})
    report = replace(mango.report, design=SimpleNamespace(**{**vars(design), "fruit": fruit}))
    assert render_board_files(replace(mango.measuring(), report=report), calibrated=False) == files_of(mango)
