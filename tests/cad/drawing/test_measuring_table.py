"""The table of the drawing: its dimensions, their tolerances, and what each moves."""

import math

import pytest
from squares import RESIN, square_sensor

from cad.drawing.housing_drawing import draw_housing_sheet
from cad.drawing.measuring_table import find_general_tolerance, list_measured_dimensions
from cad.drawing.sheet import Title
from sensor.design.processes import PROCESSES
from sensor.theory.leaf_spring import pair_stiffness

PETG = PROCESSES["fdm-petg"]
TITLE = Title(name="paper", process=PETG)
ROUNDED_MM = 0.0051  # to two decimals
GROUND_MM = 0.01  # of ground bar, as dealers sell it


DEFLECTIONS = (0.3, 0.05)  # [mm] at full travel


def table_of(sensor, process=PETG, deflections=DEFLECTIONS):
    """Return the rows of the table of a sensor by their first cells."""
    return {
        row[0]: row[1:] for one in list_measured_dimensions(sensor, process, deflections).values() for row in one.rows
    }


def nominals(housing):
    """Return the lengths [mm] that a maker measures, by the first cell of the row."""
    low, high = housing.low, housing.high
    out = housing.protrusion + housing.beyond_face
    tip = housing.dome.radius if housing.dome else housing.touching_side
    found = {
        "a1": low.thickness, "a2": low.thickness, "b1": high.thickness, "b2": high.thickness, "c": low.length,
        "d": high.length, "e": low.depth, "f": low.fillet, "g": housing.cavity_level - housing.low_top_level,
        "h": housing.cavity_level - housing.high_top_level, "j": housing.spacing, "k1": out, "k2": out, "m": 0.0,
        "n1": tip, "n2": tip,
    }  # fmt: skip
    return {**found, "p": housing.back_to_back.pad_height} if housing.back_to_back else found


@pytest.mark.parametrize("kind", ["pair", "square", "pins"])
def test_table_of_the_sheet_has_every_dimension_that_a_maker_measures(kind, sensor, pinned):
    of = {"pair": sensor, "square": square_sensor(), "pins": pinned}[kind]
    table = table_of(of)
    assert {name: float(row[1]) for name, row in table.items()} == pytest.approx(nominals(of.housing), abs=ROUNDED_MM)
    shown = {text for text, _ in draw_housing_sheet(of, TITLE, DEFLECTIONS).canvas.find_texts()}
    assert {text for name, row in table.items() for text in (name, *row)} <= shown


def test_leaves_and_levels_of_tips_have_the_accuracy_of_the_process_and_pins_that_of_their_grinder(sensor, pinned):
    """And so has the high stop, for lengths under 0.5 mm: ISO 2768-1 has no tolerance for them."""
    tables = [table_of(of) for of in (sensor, pinned)]
    for table, level in zip(tables, (PETG.accuracy_mm, GROUND_MM), strict=True):
        fine = {name for name, row in table.items() if row[2] in (f"±{PETG.accuracy_mm:g}", f"±{level:g}")}
        assert fine == {"a1", "a2", "b1", "b2", "c", "d", "h", "m"}  # thicknesses, lengths, stop, high less low
        assert table["m"][2] == f"±{level:g}"
    assert [tables[1][name][2] for name in ("n1", "n2")] == ["h8", "h8"]


@pytest.mark.parametrize(
    ("deflections", "tolerances"),
    [
        ((0.3, 0.05), (0.2, 0.05)),  # the general tolerance of 0.75 mm, and that of lengths under 0.5 mm
        ((0.502, 0.109), (0.14, 0.05)),  # 0.75 - 1.2 x 0.502 = 0.1476
        ((0.5, 0.24), (0.15, 0.01)),  # 0.3 - 1.2 x 0.24 = 0.012
    ],
)
def test_gap_at_its_lower_limit_passes_the_verdict_on_its_stop(deflections, tolerances, sensor):
    """The gaps are 0.75 and 0.3 mm; the verdict asks for 1.2 times the deflection at full travel."""
    table = table_of(sensor, deflections=deflections)
    assert [table[name][2] for name in ("g", "h")] == [f"±{tolerance:g}" for tolerance in tolerances]
    for name, deflection, tolerance in zip(("g", "h"), deflections, tolerances, strict=True):
        assert float(table[name][1]) - tolerance >= 1.2 * deflection - 1e-9


def test_what_a_tenth_more_moves_is_the_law_of_beams_and_of_contact(sensor):
    """One leaf of two by half, a flat face by its width, a force by the travel of 0.6 mm, a ball by the root of R."""
    table = list_measured_dimensions(sensor, PETG, DEFLECTIONS)
    low = sensor.housing.low
    K = [pair_stiffness(2000.0, low.depth, t, low.length) for t in (0.8, 0.9)]
    pairs = {
        "low thickness": ("K_l", 50.0 * (K[1] / K[0] - 1.0)),
        "low length": ("K_l", 100.0 * ((25.0 / 25.1) ** 3 - 1.0)),
        "depth": ("K", 100.0 * 0.1 / 6.0),
        "height": ("force", 100.0 * 0.1 / 0.6),
        "tip": ("contact", 10.0),
    }
    for name, (what, percent) in pairs.items():
        assert table[name].moves == f"{what} {percent:+.2g} %"
    square = list_measured_dimensions(square_sensor(), RESIN, DEFLECTIONS)
    assert square["tip"].moves == f"contact {100.0 * (math.sqrt(1.01) - 1.0):+.2g} %"


@pytest.mark.parametrize(
    ("process", "length", "is_radius", "tolerance"),
    [
        ("fdm-petg", 28.0, False, 0.2),
        ("fdm-petg", 0.3, False, 0.05),
        ("sls-pa12", 0.49, False, 0.1),
        ("dmls-17-4ph", 6.0, False, 0.1),  # ISO 2768-1 m, table 1
        ("dmls-17-4ph", 30.0, False, 0.2),
        ("dmls-17-4ph", 31.0, False, 0.3),
        ("dmls-17-4ph", 0.5, True, 0.2),  # table 2
        ("dmls-17-4ph", 10.0, True, 1.0),
    ],
)
def test_general_tolerance_is_that_of_the_standard_or_of_print_services(process, length, is_radius, tolerance):
    assert find_general_tolerance(PROCESSES[process], length, is_radius=is_radius) == tolerance
