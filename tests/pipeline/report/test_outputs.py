"""The files that say what a run has found: a design that repeats it, and every file with its digest."""

from dataclasses import replace

import pytest
from stand_ins import result_of

from pipeline.options import ROUGH_TOLERANCE, RunOptions
from pipeline.report.outputs import earlier_answer, refuse_folder_of_a_run, write_outputs
from pipeline.storage.folder import OutputError, output_folder
from sensor.design.design_file import design_from_mapping
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.input_file import read_toml


def test_design_file_is_the_design_and_says_how_it_was_run(tmp_path):
    design = Design(name="kiwi", fruit=Fruit(E_MPa=(1.0, 2.0)))
    options = RunOptions(fruit_stiffness="hayes", tolerance=0.02)
    write_outputs(result_of(design, options), tmp_path)
    path = tmp_path / "design.toml"
    assert design_from_mapping(read_toml(path, "--design")) == design
    first = path.read_text(encoding="utf-8").splitlines()[0]
    flags = "--fruit-stiffness hayes --tol 0.02"
    assert first == f"# pipeline run --design design.toml {flags}"
    made = replace(options, fabrication=True, fields=True)
    assert made.command == f"pipeline design --design design.toml {flags} --fields"


def answered(design, out, made=(), **options):
    """Write the outputs of a design to a folder where earlier ones may lie, with files that this command makes."""
    asked = RunOptions(out=out, **options)
    with output_folder(out) as folder:
        for name in made:
            (folder / name).write_text(f"{design.name} {name}", encoding="utf-8")
        write_outputs(result_of(design, asked), folder)
    return asked.command


def test_new_answer_replaces_all_files_of_the_one_before(tmp_path):
    """Those that go are counted, with the command that makes them; of one more answer by the same command none do."""
    out = tmp_path / "a folder"
    answered(Design(name="kiwi"), out, made=["sheet.md", "drawing.svg"], fabrication=True)
    before = earlier_answer(out)
    assert len(before.names) == 5
    command = answered(Design(name="kiwi"), out)
    assert {path.name for path in out.iterdir()} == {"design.toml", "response.csv", "report.json"}
    told = before.lost_files_text(out, command)
    assert told.startswith("files of the earlier run that were removed: 2,")
    assert f"pipeline design --design '{out}/design.toml' " in told
    assert earlier_answer(out).lost_files_text(out, command) is None


def test_files_that_the_same_command_makes_no_more_are_counted_alone(tmp_path):
    out = tmp_path / "out"
    answered(Design(), out, made=["cover.stl"])
    before = earlier_answer(out)
    command = answered(Design(), out)
    assert (
        before.lost_files_text(out, command) == "files of the earlier run that were removed: 1, for example cover.stl"
    )


def test_look_refuses_the_folder_of_a_whole_run_and_takes_its_own(tmp_path):
    run, look = tmp_path / "run", tmp_path / "look"
    refuse_folder_of_a_run(run)  # a new one
    answered(Design(), run)
    answered(Design(), look, look=True, tolerance=ROUGH_TOLERANCE)
    refuse_folder_of_a_run(look)
    with pytest.raises(OutputError) as refused:
        refuse_folder_of_a_run(run)
    assert (refused.value.field, refused.value.value) == ("--out", str(run))
