"""Hostile tables: each is read or refused in one line, soon, and none that contradicts itself is read."""

import time

import pytest
from export_shapes import Shape
from hostile_tables import bombs, contradictory, damaged, invented

from instrument.compress.phases import split_phases
from instrument.compress.specimens import QUANTITIES, read_specimens
from instrument.press.signals import Signal
from pipeline.tables.headers import ColumnFlags
from pipeline.tables.measured_table import numbers_of
from pipeline.tables.rows import single_sheet
from sensor.quantity import InputError

KINDS = {"damaged": damaged, "invented": invented}
SOME_BOMBS = ("zip", "far cell", "entities", "quotes", "header", "words")
SEEDS = [
    range(30),
    *(pytest.param(range(first, first + 100), marks=pytest.mark.study) for first in range(1000, 2000, 100)),
]
SOON = 20.0  # [s] of the processor: the largest table takes 5 s


def outcome(shape, tmp_path):
    """Return whether a table is read as a compression test; by each reader it is read, or refused in one line."""
    path = tmp_path / f"hostile.{shape.suffix}"
    path.write_bytes(shape.content)
    flags = ColumnFlags(shape.columns, shape.units)
    readers = (
        lambda: list(map(split_phases, read_specimens(path, flags.applied(QUANTITIES)))),
        lambda: list(Signal(single_sheet(path), 2)),
        lambda: numbers_of(path, QUANTITIES, [("force", "travel")], "force_N,travel_mm"),
    )
    done = []
    lines = []
    for reader in readers:
        start = time.process_time()
        try:
            done.append(bool(reader()))
        except InputError as error:
            done.append(False)
            lines += str(error).splitlines()[1:]
        assert time.process_time() - start < SOON
    assert lines == []
    return done[0]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seeds", SEEDS, ids=str)
def test_damaged_table_is_read_or_refused(kind, seeds, tmp_path):
    for seed in seeds:
        outcome(KINDS[kind](seed), tmp_path)


@pytest.mark.parametrize("shape", contradictory(), ids=lambda shape: shape.content[:40])
def test_table_that_contradicts_itself_is_refused(shape, tmp_path):
    assert not outcome(shape, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("names", [SOME_BOMBS, pytest.param((), id="all", marks=pytest.mark.study)])
def test_bomb_is_refused_or_read_soon(names, tmp_path):
    shapes = bombs()
    for name in names or shapes:
        outcome(shapes[name], tmp_path)


@pytest.mark.study
def test_many_parted_thousands_are_read_soon(tmp_path):
    """Every second number may be parted or not: that its column shows it is found once, not for each of them."""
    rows = [f'{0.001 * row:.3f},"{1 + row // 1000},{row % 1000:03d}{".5" if row % 2 else ""}"' for row in range(40_000)]
    assert outcome(Shape("\n".join(["travel_mm,force_N", *rows]).encode()), tmp_path)
