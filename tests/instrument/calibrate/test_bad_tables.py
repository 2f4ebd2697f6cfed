"""Tables of weights and of a plate with one fault: it is named, or the stiffnesses stay in their bar."""

import numpy as np
import pytest
from bad_tables import COUNTS_PER_N, FAULTS, GRAM, PlantedUnit, outcomes

from sensor.quantity import InputError

COUNTS = "tip,weight_g,deflection_mm,counts_l,counts_h\n"


@pytest.mark.parametrize("tables", [40, pytest.param(344, marks=pytest.mark.study)])
def test_a_planted_fault_is_named_or_in_the_bar(tables, paper):
    """The bar holds 95 % of tables without a fault: one of five, or three of 43, may miss it by chance."""
    counted = outcomes(paper.report, tables, seed=23)
    assert set(counted) == {"none", *FAULTS}
    each = tables // len(counted)
    assert counted["none"]["in the bar"] >= each - max(1, round(0.07 * each))
    for fault in FAULTS:
        assert counted[fault]["wrong"] <= max(0, round(0.05 * each) - 1)
    for fault in ("swapped", "dead"):
        assert counted[fault]["named"] == each


def weights(unit, **spoilt):
    """Return a table of weights up and down; `spoilt` has new cells by line and column."""
    tables = unit.tables(np.zeros(2), np.zeros(2), 4)
    rows = [[("low", "high")[int(row[0])], *row[1:]] for row in tables[0]]
    for key, value in spoilt.items():
        line, column = map(int, key.removeprefix("at_").split("_"))
        rows[line - 2][column] = value
    return COUNTS + "\n".join(",".join(map(str, row)) for row in rows)


@pytest.fixture
def unit(paper):
    return PlantedUnit(paper.K, np.random.default_rng(4))


@pytest.mark.parametrize(("line", "column", "name"), [(4, 2, "deflection"), (6, 3, "counts_l"), (13, 4, "counts_h")])
def test_the_row_that_does_not_fit_is_named(line, column, name, unit, paper, calibrate, tmp_path):
    assert calibrate(paper.report, weights(unit)).unit.stiffnesses == pytest.approx(unit.K.tolist(), rel=0.01)
    value = 4194303 if column > 2 else 0.9
    with pytest.raises(InputError) as caught:
        calibrate(paper.report, weights(unit, **{f"at_{line}_{column}": value}))
    assert caught.value.field == f"{tmp_path / 'measured.csv'}, line {line}, column {name!r}"
    assert caught.value.value == value


def test_a_channel_that_shows_nothing_is_one_line(unit, paper, calibrate):
    for column in (3, 4):
        dead = {f"at_{line}_{column}": 0 for line in range(2, 20)}
        with pytest.raises(InputError) as caught:
            calibrate(paper.report, weights(unit, **dead))
        assert ("counts_l", "counts_h")[column - 3] in caught.value.field


def test_loads_and_travels_of_nothing_are_one_line(unit, paper, calibrate):
    head, *rows = weights(unit).splitlines()
    tiny = [",".join([cells[0], f"{cells[1]}e-160", *cells[2:]]) for cells in (row.split(",") for row in rows)]
    with pytest.raises(InputError):
        calibrate(paper.report, "\n".join([head, *tiny]))
    plate = unit.tables(np.zeros(2), np.zeros(2), 4)[1]
    lines = [f"{row[0]}e-300,{row[1]:.0f},{row[2]:.0f}" for row in plate]
    with pytest.raises(InputError):
        calibrate(paper.report, weights(unit), "\n".join(["travel_mm,counts_l,counts_h", *lines]))


def plate_table(unit, K=1.0, late=0.0, digits=4):
    """Return a press on a plate of a unit whose low spring shows a stiffness times K, its tip late by [mm]."""
    stiffer = PlantedUnit(unit.K, np.random.default_rng(5))
    stiffer.K, stiffer.gains, stiffer.zero = unit.K * [K, 1.0], unit.gains, unit.zero
    plate = stiffer.tables(np.array([late, 0.0]), np.zeros(2), digits)[1]
    rows = [f"{row[0]:.{digits}f},{row[1]:.0f},{row[2]:.0f}" for row in plate]
    return "\n".join(["travel_mm,counts_l,counts_h", *rows])


def test_channels_on_a_plate_are_compared_with_each_other(unit, paper, calibrate):
    """Three per cent apart are refused, with the tip that weights contradict; less is in the bar."""
    table = weights(unit)
    with pytest.raises(InputError) as caught:
        calibrate(paper.report, table, plate_table(unit, K=1.059))
    assert "low" in caught.value.field
    found = calibrate(paper.report, table, plate_table(unit, K=1.02)).unit
    assert abs(found.stiffnesses[0] / unit.K[0] - 1.0) < 0.02 * found.K_percent[0]
    good = calibrate(paper.report, table, plate_table(unit)).unit
    assert good.K_percent[0] < 0.5 * found.K_percent[0]


@pytest.mark.parametrize("share", [0.12, 0.15, 0.25])
def test_a_tip_that_touches_late_is_named_or_in_the_bar(share, unit, paper, calibrate):
    try:
        found = calibrate(paper.report, weights(unit), plate_table(unit, late=share * 0.16)).unit
    except InputError:
        return
    off = np.abs(np.array(found.stiffnesses) / unit.K - 1.0)
    assert (off < 0.02 * np.array(found.K_percent)).all()


def test_a_plate_that_tells_less_than_the_weights_is_said_to(unit, paper, calibrate):
    """Travel to 0.01 mm of 0.16 mm: the note names both errors and the last digit."""
    table = weights(unit)
    assert calibrate(paper.report, table, plate_table(unit)).assumed == []
    coarse = calibrate(paper.report, table, plate_table(unit, digits=2))
    assert len(coarse.assumed) == 1
    assert "0.01 mm" in coarse.assumed[0]


def test_the_planted_unit_counts_its_forces(unit):
    """By its gains, near those that are named."""
    counts = np.array(unit.counts(np.array([20.0 * GRAM, 0.0]))) - unit.zero
    assert counts[0] == pytest.approx(20.0 * GRAM * COUNTS_PER_N[0], rel=0.3)


WEIGHED = [("low", 20.0 * k, 0.185 * k) for k in range(6)] + [("high", 100.0 * k, 0.043 * k) for k in range(5)]


def table_of(rows, header="tip,weight_g,deflection_mm", names=("low", "high")):
    called = dict(zip(("low", "high"), names, strict=True))
    return "\n".join([header, *(f"{called[tip]},{weight:.0f},{shown:.4f}" for tip, weight, shown in rows), ""])


@pytest.mark.parametrize(
    ("header", "names"),
    [
        ("tip,weight_g,deflection_mm", ("Low", "HIGH ")),
        ("tip,Load [g],travel_mm", ("L", "H")),
        ("Tip,Mass (g),Displacement (mm)", ("l", "h")),
        ("Spitze,Masse [g],Weg [mm]", ("LOW", "high")),
        ("Spitze;Gewicht in g;Verschiebung in mm".replace(";", ","), ("low", "high")),
    ],
)
def test_words_and_names_of_other_benches_give_the_same_springs(header, names, paper, calibrate):
    plain = calibrate(paper.report, table_of(WEIGHED)).unit.stiffnesses
    assert calibrate(paper.report, table_of(WEIGHED, header, names)).unit.stiffnesses == plain


@pytest.mark.parametrize("row", [3, 8])
@pytest.mark.parametrize("change", ["weight x 10", "deflection x 10", "other tip", "letter"])
def test_a_typing_error_in_one_row_of_weights_is_named(row, change, paper, calibrate):
    rows = list(WEIGHED)
    tip, weight, shown = rows[row]
    changed = {
        "weight x 10": (tip, 10.0 * weight, shown),
        "deflection x 10": (tip, weight, 10.0 * shown),
        "other tip": ({"low": "high", "high": "low"}[tip], weight, shown),
        "letter": (tip, weight, shown),
    }
    rows[row] = changed[change]
    lines = table_of(rows).splitlines()
    if change == "letter":
        lines[row + 1] = lines[row + 1].replace("0,", "O,", 1)
    with pytest.raises(InputError) as caught:
        calibrate(paper.report, "\n".join(lines))
    assert f"line {row + 2}" in caught.value.field
