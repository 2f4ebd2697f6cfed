import dataclasses
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

import sensor.design.processes
from sensor.design.processes import PROCESSES, Process
from sensor.quantity import InputError

NUMBERS = [item.name for item in dataclasses.fields(Process) if "unit" in item.metadata]
each_process = pytest.mark.parametrize("process", PROCESSES.values(), ids=PROCESSES)


@each_process
def test_numbers_lie_where_their_kind_does(process):
    """Plastics creep by less than a tenth in a decade, known to no better than a quarter of it; metals do not."""
    assert [name for name, source in process.sources if len(source) <= len("typical")] == []
    assert process.min_wall_mm <= process.leaf_thickness_low_mm < process.leaf_thickness_high_mm
    assert process.accuracy_mm < 0.2 * process.leaf_thickness_low_mm
    stress = process.strain_limit * process.E_MPa
    if process.kind == "dmls":
        assert (1e5 < process.E_MPa < 2.2e5, 0.005 <= process.E_scatter <= 0.05, stress < 500.0) == (True, True, True)
        assert (process.creep.exponent, process.creep.error) == (0.0, 0.0)
    else:
        assert (1e3 < process.E_MPa < 5e3, 0.05 <= process.E_scatter <= 0.2, stress < 25.0) == (True, True, True)
        assert 0.01 <= process.creep_per_decade <= 0.1
        assert process.creep_scatter >= 0.25 * process.creep_per_decade


PETG = PROCESSES["fdm-petg"]


def without(name):
    """Return the sources of PETG but that of one number."""
    return tuple(item for item in PETG.sources if item[0] != name)


NEEDED = [name for name in NUMBERS if name not in ("line_width_mm", "layer_mm")]


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        *((name, {name: value}) for name in NEEDED for value in ("1", None)),
        ("accuracy_mm", {"accuracy_mm": 0.37}),  # a leaf of 0.8 mm may have nothing left
        ("E_scatter", {"E_scatter": 0.24}),  # a modulus may have nothing left
        *((name, {name: None, "sources": without(name)}) for name in ("creep_per_decade", "creep_scatter")),
        ("E_MPa", {"sources": without("E_MPa")}),
        ("colour", {"sources": (*PETG.sources, ("colour", "a guess"))}),
    ],
)
def test_process_is_refused_by_its_wrong_number(field, changes):
    with pytest.raises(InputError) as error:
        dataclasses.replace(PETG, **changes)
    assert error.value.field == f"process fdm-petg.{field}"


TABLE = Path(sensor.design.processes.__file__).with_name("processes.toml")


def test_data_files_ship_in_the_wheel():
    shipped = {file.distribution_path for file in WheelBuilder(str(TABLE.parents[2])).recurse_included_files()}
    assert {
        "sensor/design/processes.toml",
        "sensor/design/electronics.toml",
        "cad/fabrication/fabrication_sheet.md.jinja",
    } <= shipped


@each_process
def test_lines_fill_the_leaves_and_layers_the_depth(process):
    for step, sizes in (
        (process.line_width_mm, (process.leaf_thickness_low_mm, process.leaf_thickness_high_mm, process.min_wall_mm)),
        (process.layer_mm, (process.depth_mm,)),
    ):
        for size in sizes if step else ():
            assert size / step == pytest.approx(round(size / step)), (process.name, size, step)
    assert (process.line_width_mm is not None) == (process.kind == "fdm")


@pytest.mark.parametrize(
    ("process", "depth", "printed"),
    [
        (PETG, 4.45, 4.4),  # 22.25 layers of 0.2 mm; PrusaSlicer 2.5 prints each of these depths so
        (PETG, 4.75, 4.8),
        (PETG, 5.9, 6.0),  # 29.5 layers
        (PETG, 6.0, 6.0),
        (PROCESSES["sls-pa12"], 4.45, 4.45),  # no slicer of its own
        (dataclasses.replace(PETG, layer_mm=None, sources=without("layer_mm")), 4.45, 4.45),
    ],
)
def test_a_depth_is_printed_as_whole_layers(process, depth, printed):
    assert process.printed_depth_mm(depth) == pytest.approx(printed, rel=1e-12)
    assert (process.printed_depth_mm(depth) == depth) == (depth == printed)
