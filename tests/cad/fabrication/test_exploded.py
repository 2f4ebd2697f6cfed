"""The picture of the sensor taken apart: nothing overlaps along the screws, and numbers are rows of the bill."""

import itertools
import re

import pytest
from squares import RESIN, square_sensor

from cad.fabrication.bill import bill_of_materials
from cad.fabrication.exploded import explode, write_exploded
from cad.fabrication.mount import bracket_solid
from cad.parts.assembly import assemble_sensor, placed_shape
from sensor.design.processes import PROCESSES

MASSES = dict.fromkeys(("housing", "cover", "coupon", "mount"), 1.0)
PROCESS = {"sensor": PROCESSES["fdm-petg"], "pinned": PROCESSES["fdm-petg"], "square": RESIN}
SHOWN = {
    "sensor": ["screw", "washer", "housing", "mount", "washer", "nut"],
    "pinned": ["screw", "washer", "cover", "housing", "cover", "mount", "washer", "nut", "pin"],
    "square": ["screw", "washer", "cover", "housing", "dowel", "housing", "cover", "mount", "washer", "nut"],
}


@pytest.fixture(params=list(SHOWN))
def case(request):
    """Return a sensor, its bill, and the parts of which a picture shows groups."""
    shown = square_sensor() if request.param == "square" else request.getfixturevalue(request.param)
    assembly = assemble_sensor(shown)
    bill = bill_of_materials(shown, assembly, PROCESS[request.param], MASSES)
    return assembly.add(bracket_solid(shown), name="mount"), bill, SHOWN[request.param]


def test_every_body_but_the_fruit_is_shown_and_none_overlaps_another_kind(case):
    shown, _, _ = case
    groups = explode(shown)
    names = {part.name for group in groups.values() for part in group}
    assert names == {part.name for part in shown.children} - {"fruit"}
    spans = []
    for place, group in groups.items():
        if not place.startswith("pin"):
            boxes = [placed_shape(part).BoundingBox() for part in group]
            spans.append((min(box.ymin for box in boxes), max(box.ymax for box in boxes)))
    assert all(end < start for (_, end), (start, _) in itertools.pairwise(spans))


@pytest.mark.slow
def test_numbers_are_those_of_the_bill_and_stand_apart(case, tmp_path):
    shown, bill, parts = case
    write_exploded(shown, bill, tmp_path / "exploded.svg")
    text = (tmp_path / "exploded.svg").read_text(encoding="utf-8")
    balloons = [(float(x), int(number)) for x, number in re.findall(r'<text x="(\S+)"[^>]*>(\d+)</text>', text)]
    assert sorted(bill[number - 1].part for _, number in balloons) == sorted(parts)
    assert all(first + 7.0 < second for (first, _), (second, _) in itertools.pairwise(balloons))
