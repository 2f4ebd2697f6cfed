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
def test_every_number_has_one_source(process):
    given = {name for name in NUMBERS if getattr(process, name) is not None}
    assert {field for field, _ in process.sources} == given
    assert len(process.sources) == len(given)
    for name in given:
        assert len(dict(process.sources)[name]) > len("typical"), name


@each_process
def test_leaves_are_thicker_than_the_wall_and_the_high_ones_than_the_low(process):
    assert process.min_wall_mm <= process.leaf_thickness_low_mm < process.leaf_thickness_high_mm
    assert process.accuracy_mm < 0.2 * process.leaf_thickness_low_mm


@each_process
def test_moduli_lie_where_their_kind_does(process):
    plastic = process.kind != "dmls"
    low, high = (1e3, 5e3) if plastic else (1e5, 2.2e5)
    assert low < process.E_MPa < high
    assert (0.05 if plastic else 0.005) <= process.E_scatter <= (0.2 if plastic else 0.05)
    assert process.strain_limit * process.E_MPa < (25.0 if plastic else 500.0)  # stress [MPa]


@pytest.mark.parametrize("name", [name for name in NUMBERS if name not in ("line_width_mm", "layer_mm")])
@pytest.mark.parametrize("value", ["1", None])
def test_number_that_is_none_is_refused(name, value):
    with pytest.raises(InputError) as error:
        dataclasses.replace(PROCESSES["fdm-petg"], **{name: value})
    assert error.value.field == f"process fdm-petg.{name}"


@pytest.mark.parametrize(("name", "value"), [("accuracy_mm", 0.37), ("E_scatter", 0.24)])
def test_print_that_may_have_no_leaf_or_no_modulus_left_is_refused(name, value):
    with pytest.raises(InputError) as error:
        dataclasses.replace(PROCESSES["fdm-petg"], **{name: value})
    assert error.value.field == f"process fdm-petg.{name}"


@pytest.mark.parametrize("name", ["creep_per_decade", "creep_scatter"])
def test_creep_without_its_spread_is_refused(name):
    with pytest.raises(InputError) as error:
        dataclasses.replace(PROCESSES["fdm-petg"], **{name: None}, sources=without(name))
    assert error.value.field == f"process fdm-petg.{name}"


@each_process
def test_plastics_creep_and_metals_do_not(process):
    """By less than a tenth in a decade, known to no better than a quarter of it."""
    if process.kind == "dmls":
        assert (process.creep.exponent, process.creep.error) == (0.0, 0.0)
    else:
        assert 0.01 <= process.creep_per_decade <= 0.1
        assert process.creep_scatter >= 0.25 * process.creep_per_decade


def without(name):
    """Return the sources of PETG but that of one number."""
    return tuple(item for item in PROCESSES["fdm-petg"].sources if item[0] != name)


def test_number_without_a_source_is_refused():
    petg = PROCESSES["fdm-petg"]
    for key, sources in (("E_MPa", without("E_MPa")), ("colour", (*petg.sources, ("colour", "a guess")))):
        with pytest.raises(InputError) as error:
            dataclasses.replace(petg, sources=sources)
        assert error.value.field == f"process fdm-petg.{key}"


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
