import dataclasses
import math
import re
import typing
from typing import Any

import pytest

from cad.design import parameters
from cad.design.design_file import TABLE_TYPES
from cad.design.fruit import Fruit
from cad.design.parameters import TABLES, Design, GivenSprings, Print
from cad.design.processes import PROCESSES
from cad.design.tips import Press, Tips
from cad.quantity import InputError

KINDS = TABLE_TYPES
NUMBERS = [
    (table, item) for table, kind in KINDS.items() for item in dataclasses.fields(kind) if "unit" in item.metadata
]
CHOICES = [
    (table, item) for table, kind in KINDS.items() for item in dataclasses.fields(kind) if "options" in item.metadata
]
each_number = pytest.mark.parametrize(
    ("table", "item"), NUMBERS, ids=[f"{table}.{item.name}" for table, item in NUMBERS]
)
each_choice = pytest.mark.parametrize(
    ("table", "item"), CHOICES, ids=[f"{table}.{item.name}" for table, item in CHOICES]
)
UNIT_OF_ENDING = {"_mm": "mm", "_MPa": "MPa", "_deg": "deg", "_N_per_m": "N/m", "_N": "N", "_percent": "%"}


def _refused(table: str, **values: Any) -> str:
    with pytest.raises(InputError) as caught:
        Design(**{table: KINDS[table](**values)})
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    return message


def test_defaults_are_the_paper():
    design = Design()
    assert (design.targets.P_max, design.targets.NL, design.targets.NL_definition) == (5.0, 0.05, "mid-range")
    fruit, tips, press = design.fruit, design.tips, design.press
    assert (fruit.length_mm, fruit.width_mm, fruit.height_mm, fruit.poisson) == (20.0, 20.0, 12.0, 0.3)
    assert fruit.E_max_MPa == 3.5
    assert fruit.E_MPa == (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5)
    assert (tips.shape, tips.side_mm, tips.spacing_mm, tips.offset_mm, tips.gap_mm) == ("cube", 1.0, 8.0, 0.0, 0.5)
    assert (press.travel_mm, press.tilt_deg) == (0.6, 0.0)
    assert (design.print.process, design.print.max_length_mm) == ("fdm-petg", 120.0)
    assert not design.springs.given
    assert design.fruit.bruise_limit_MPa is None


@each_number
def test_unit_is_told_by_the_name(table, item):
    ending = next((ending for ending in UNIT_OF_ENDING if item.name.endswith(ending)), None)
    assert item.metadata["unit"] == (UNIT_OF_ENDING[ending] if ending else "1"), f"{table}.{item.name}"
    assert item.metadata["remedy"], f"{table}.{item.name}"


@each_number
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, "five", True])
def test_what_is_no_number_is_refused(table, item, bad):
    several = typing.get_origin(item.type) is tuple
    message = _refused(table, **{item.name: (bad,) if several else bad})
    unit = "" if item.metadata["unit"] == "1" else f" {item.metadata['unit']}"
    shown = repr(bad) if isinstance(bad, str) else f"{bad}"
    pattern = rf"^{table}\.{item.name} = {re.escape(shown + unit)}: must be (a number )?(.+); (.+)$"
    found = re.match(pattern, message)
    assert found, message
    assert found.group(2) == str(item.metadata["bounds"])
    assert found.group(3) == item.metadata["remedy"]


@each_number
def test_value_beyond_each_bound_is_refused_and_one_inside_is_not_refused_for_it(table, item):
    bounds = item.metadata["bounds"]
    several = typing.get_origin(item.type) is tuple
    outside = {
        "above": bounds.above,
        "at_least": None if bounds.at_least is None else math.nextafter(bounds.at_least, -math.inf),
        "below": bounds.below,
        "at_most": None if bounds.at_most is None else math.nextafter(bounds.at_most, math.inf),
    }
    assert any(value is not None for value in outside.values())
    for value in (value for value in outside.values() if value is not None):
        assert f"must be {bounds};" in _refused(table, **{item.name: (value,) if several else value})


@pytest.mark.parametrize(
    ("table", "field", "words"),
    [
        ("targets", "P_max", "at least 1.001 and at most 100"),
        ("targets", "NL", "at least 1e-05 and at most 0.4999"),
        ("fruit", "poisson", "greater than -1 and less than 0.5"),
        *(("fruit", name, "at least 1e-06 and at most 1000") for name in ("length_mm", "width_mm", "height_mm")),
        *(("tips", name, "at least 1e-06 and at most 1000") for name in ("side_mm", "spacing_mm")),
        ("press", "travel_mm", "at least 1e-06 and at most 1000"),
    ],
)
def test_bounds_are_those_of_the_contract(table, field, words):
    assert str(KINDS[table].__dataclass_fields__[field].metadata["bounds"]) == words


@pytest.mark.parametrize(
    ("table", "values", "message"),
    [
        ("targets", {"NL": 0.0}, "targets.NL = 0: must be at least 1e-05 and at most 0.4999; give a fraction"),
        ("targets", {"NL": -0.1}, "targets.NL = -0.1: must be at least 1e-05 and at most 0.4999; give a fraction"),
        ("targets", {"NL": 0.5}, "targets.NL = 0.5: must be at least 1e-05 and at most 0.4999; give a fraction"),
        ("targets", {"NL": 5}, "targets.NL = 5: must be at least 1e-05 and at most 0.4999; give a fraction"),
        ("targets", {"P_max": 1.0}, "targets.P_max = 1: must be at least 1.001 and at most 100; the paper uses 5"),
        ("targets", {"P_max": 1e9}, "targets.P_max = 1e+09: must be at least 1.001 and at most 100; the paper"),
        ("fruit", {"poisson": 0.5}, "fruit.poisson = 0.5: must be greater than -1 and less than 0.5; fruit flesh"),
        ("fruit", {"poisson": -1.0}, "fruit.poisson = -1: must be greater than -1 and less than 0.5; fruit flesh"),
        ("fruit", {"E_MPa": ()}, "fruit.E_MPa = () MPa: must be a list of at least one number, each at least 1e-06"),
        ("fruit", {"E_MPa": (1.0, 0.0)}, "fruit.E_MPa = 0 MPa: must be at least 1e-06 and at most 1e+06; list"),
        ("fruit", {"E_max_MPa": -1.0}, "fruit.E_max_MPa = -1 MPa: must be at least 1e-06 and at most 1e+06; give"),
        ("fruit", {"length_mm": 1e12}, "fruit.length_mm = 1e+12 mm: must be at least 1e-06 and at most 1000; the"),
        ("print", {"process": "fdm"}, "print.process = 'fdm': must be one of fdm-petg, fdm-pla, sls-pa12, sla-resin"),
        ("tips", {"spacing_mm": 1.0}, "tips.spacing_mm = 1 mm: must be greater than tips.side_mm = 1 mm; the tips ov"),
        ("springs", {"K_l_N_per_m": 1.0}, "springs.K_h_N_per_m = None: must be given together with springs.K_l_N_per"),
        ("springs", {"K_h_N_per_m": 1.0}, "springs.K_l_N_per_m = None: must be given together with springs.K_h_N_per"),
        (
            "springs",
            {"K_l_N_per_m": 17300.0, "K_h_N_per_m": 753.0},
            "springs.K_l_N_per_m = 17300 N/m: must be less than springs.K_h_N_per_m = 753 N/m; the low spring is",
        ),
    ],
)
def test_message_of_a_bad_table(table, values, message):
    assert _refused(table, **values).startswith(message)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"name": "a/b"}, "name = 'a/b': must be 1 to 64 letters, digits, - or _; it names files and folders"),
        ({"name": ""}, "name = '': must be 1 to 64 letters, digits, - or _; it names files and folders"),
        ({"name": "x" * 65}, f"name = '{'x' * 65}': must be 1 to 64 letters, digits, - or _; it names"),
        ({"name": "mangó"}, "name = 'mangó': must be 1 to 64 letters, digits, - or _; it names files and folders"),
        ({"name": "a\nb"}, r"name = 'a\nb': must be 1 to 64 letters, digits, - or _; it names files and folders"),
        (
            {"tips": Tips(spacing_mm=19.5)},
            "tips.spacing_mm = 19.5 mm: must be at most fruit.length_mm - side - 2 |offset| = 19 mm; the tips stand",
        ),
        (
            {"tips": Tips(offset_mm=-6.0)},
            "tips.spacing_mm = 8 mm: must be at most fruit.length_mm - side - 2 |offset| = 7 mm; the tips stand",
        ),
        (
            {"tips": Tips(side_mm=2.0), "fruit": Fruit(width_mm=1.5)},
            "tips.side_mm = 2 mm: must be at most fruit.width_mm = 1.5 mm; the tips stand beyond the fruit",
        ),
        (
            {"press": Press(travel_mm=12.0)},
            "press.travel_mm = 12 mm: must be less than fruit.height_mm = 12 mm; press less deep",
        ),
    ],
)
def test_message_where_tables_do_not_fit_together(tables, message):
    with pytest.raises(InputError) as caught:
        Design(**tables)
    assert str(caught.value).startswith(message)
    assert len(str(caught.value).splitlines()) == 1


def test_tips_may_reach_the_edge_of_the_fruit():
    assert Design(tips=Tips(spacing_mm=19.0)).tips.spacing_mm == 19.0


@each_choice
def test_choice_lists_its_options(table, item):
    message = _refused(table, **{item.name: "none of these"})
    assert message.startswith(
        f"{table}.{item.name} = 'none of these': must be one of {', '.join(item.metadata['options'])}"
    )
    assert item.default is None or item.default in item.metadata["options"]


def test_every_process_may_be_chosen():
    assert [Print(process=name).process for name in PROCESSES] == list(PROCESSES)


@pytest.mark.parametrize("tilt", [-3.0, 0.0, 5.0])
def test_tilt_lowers_the_high_tip_by_what_it_raises_the_low_one(tilt):
    design = Design(press=Press(tilt_deg=tilt))
    step = 4.0 * math.tan(math.radians(tilt))
    assert design.full_travels_mm == pytest.approx((design.press.travel_mm - step, design.press.travel_mm + step))


def test_given_springs_are_told_from_none():
    assert GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0).given
    assert not GivenSprings().given


@pytest.mark.parametrize("kind", [*KINDS.values(), Design], ids=lambda kind: kind.__name__)
def test_every_table_is_frozen_and_takes_names_only(kind):
    record = kind()
    first = dataclasses.fields(kind)[0].name
    with pytest.raises(dataclasses.FrozenInstanceError, match=f"cannot assign to field '{first}'"):
        setattr(record, first, None)
    with pytest.raises(TypeError, match="positional"):
        kind(1.0)
    assert hash(record) == hash(kind())


def test_tables_are_those_of_the_module():
    assert TABLES == ("targets", "springs", "fruit", "tips", "press", "reading", "print", "printer")
    assert all(getattr(parameters, kind.__name__) is kind for kind in KINDS.values())


def test_modulus_of_a_coupon_takes_the_place_of_the_process():
    nominal, printed = Design().process, Design(print=Print(E_MPa=1750.0)).process
    assert nominal == PROCESSES["fdm-petg"]
    assert printed == dataclasses.replace(nominal, E_MPa=1750.0)
    with pytest.raises(InputError, match=r"^print\.E_MPa = -1 MPa: must be at least 1e-06 .*; give what the coupon"):
        Print(E_MPa=-1.0)
