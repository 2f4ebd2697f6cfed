"""A record is told by what its fields declare: keys, factors, what is left out, and its line."""

from dataclasses import dataclass, field, is_dataclass

import pytest

from pipeline.storage.plain import strict_converter
from pipeline.storage.record_data import as_data, as_line, fields_by_key, structure_hook, value_at_key
from sensor.quantity import report_field


@dataclass(frozen=True, kw_only=True)
class Part:
    a: float = report_field("1", "plain")
    b: float | None = report_field("%", "a fraction", key="b_percent", times=100.0, left_out=True, default=None)


@dataclass(frozen=True, kw_only=True)
class Whole:
    name: str = report_field("", "a text", line=lambda it: f"name {it.name}")
    t: float | None = report_field(
        "s", "decides", key="t_s", left_out=True, default=None, line=lambda it: f"t {it.t:g}", absent="no time"
    )
    of_t: float | None = report_field("%", "with t", key="of_t_percent", times=100.0, left_out="t", default=None)
    tags: tuple[str, ...] = report_field("", "texts", default=(), line=lambda it: ",".join(it.tags))
    others: dict[str, float] = report_field(
        "", "named", key="`x_N`", inline=lambda it: {f"x_{key}": value for key, value in it.others.items()},
        default_factory=dict, line=lambda it: str(len(it.others)),
    )  # fmt: skip
    part: Part | None = report_field("", "nested", default=None)
    hidden: object = field(default=None, metadata={"has_key": False})


@pytest.mark.parametrize(
    ("record", "data"),
    [
        (Whole(name="n"), {"name": "n", "tags": [], "part": None}),
        (Whole(name="n", t=0.0), {"name": "n", "t_s": 0.0, "of_t_percent": None, "tags": [], "part": None}),
        (Whole(name="n", t=1.0, of_t=0.5, tags=("a",)),
         {"name": "n", "t_s": 1.0, "of_t_percent": 50.0, "tags": ["a"], "part": None}),
        (Whole(name="n", others={"N": 2.0, "m": 3.0}, hidden=object()),
         {"name": "n", "tags": [], "x_N": 2.0, "x_m": 3.0, "part": None}),
        (Whole(name="n", part=Part(a=1.0, b=0.02)), {"name": "n", "tags": [], "part": {"a": 1.0, "b_percent": 2.0}}),
        ((Part(a=1.0), Part(a=2.0)), [{"a": 1.0}, {"a": 2.0}]),
    ],
)  # fmt: skip
def test_data_are_as_declared_in_the_order_of_the_fields(record, data):
    told = as_data(record)
    assert told == data
    if isinstance(told, dict):
        assert list(told) == list(data)


@pytest.mark.parametrize(
    ("record", "names", "line"),
    [
        (Whole(name="n"), ("t", "name", "tags", "others"), "no time  name n"),
        (Whole(name="n", t=0.0, tags=("a", "b"), others={"N": 1.0}), ("others", "t", "tags"), "1  t 0  a,b"),
    ],
)
def test_line_has_the_texts_of_the_named_fields(record, names, line):
    assert as_line(record, names) == line


@dataclass(frozen=True, kw_only=True)
class Pin:
    side: float = report_field("mm", "a size", key="pin_side")
    is_round: bool = report_field("", "a shape", key="pin_round")


CONVERTER = strict_converter()
CONVERTER.register_structure_hook_factory(is_dataclass, lambda kind: structure_hook(kind, CONVERTER))


@dataclass(frozen=True, kw_only=True)
class Sizes:
    size: float = report_field("mm", "a size", key="b_size")


@dataclass(frozen=True, kw_only=True)
class Block:
    a: float = report_field("mm", "a size")
    pin: Pin | None = report_field("", "no key of its own", default=None, flat=Pin, has_key=False)
    has_b: Sizes | None = report_field("", "whether there is one", default=None, flat=Sizes)


BARE = {"a": 1.0, "pin_side": 0.0, "pin_round": False, "has_b": False, "b_size": 0.0}


@pytest.mark.parametrize(
    ("block", "data"),
    [
        (Block(a=1.0), BARE),
        (Block(a=1.0, pin=Pin(side=0.5, is_round=True)), BARE | {"pin_side": 0.5, "pin_round": True}),
        (Block(a=1.0, has_b=Sizes(size=2.0)), BARE | {"has_b": True, "b_size": 2.0}),
    ],
)
def test_keys_of_a_flat_record_stand_beside_the_others_and_are_read_back(block, data):
    assert list(as_data(block).items()) == list(data.items())
    assert CONVERTER.structure(data, Block) == block
    assert {key: value_at_key(block, key) for key in fields_by_key(Block)} == data
