"""The files that say what a run has found: a design that repeats it, and every file with its digest."""

import json
from dataclasses import replace

from stand_ins import result_of

from pipeline.options import RunOptions
from pipeline.report.check import unchanged_verdicts
from pipeline.report.outputs import write_outputs
from pipeline.report.report import read_report
from pipeline.storage.digests import with_digest
from pipeline.storage.folder import output_folder
from sensor.design.design_file import design_from_mapping, with_former_defaults
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


def second_command(design, out, made=()):
    """Write the outputs of a design to a folder where earlier ones may lie, with files that this command makes."""
    with output_folder(out) as folder:
        for name in made:
            (folder / name).write_text(f"{design.name} {name}", encoding="utf-8")
        write_outputs(result_of(design, RunOptions(out=out)), folder)


def others_of(out):
    """Return how many files of an output folder belong to another run."""
    return next(verdict.value for verdict in unchanged_verdicts(out) if verdict.name == "files.of_this_run")


def test_second_command_of_one_design_adds_to_the_folder(tmp_path):
    design = Design(name="kiwi", fruit=Fruit(E_MPa=(1.0, 2.0)))
    out = tmp_path / "kiwi"
    second_command(design, out, made=["sheet.md", "drawing.svg"])
    second_command(design, out)
    assert (out / "sheet.md").read_text(encoding="utf-8") == "kiwi sheet.md"
    assert read_report(out).stale == {}
    assert others_of(out) == 0.0


def test_files_of_another_design_are_kept_named_and_flagged_until_they_are_made_anew(tmp_path):
    first = Design(name="kiwi", fruit=Fruit(E_MPa=(1.0, 2.0)))
    second = Design(name="kiwi", fruit=Fruit(E_MPa=(1.0, 3.0)))
    out = tmp_path / "kiwi"
    second_command(first, out, made=["sheet.md", "drawing.svg"])
    second_command(second, out, made=["drawing.svg"])
    second_command(second, out)
    assert [*read_report(out).stale] == ["sheet.md"]
    assert (out / "sheet.md").read_text(encoding="utf-8") == "kiwi sheet.md"
    assert others_of(out) == 1.0
    second_command(first, out)
    assert [*read_report(out).stale] == ["drawing.svg"]
    second_command(first, out, made=["drawing.svg"])
    assert others_of(out) == 0.0


def test_files_that_no_command_makes_any_more_are_dropped(tmp_path):
    """A folder of 0.1 has drawings of parts, and a key of the design that left; its cover is of the same design."""
    out = tmp_path / "out"
    second_command(Design(), out, ("drawing-cover.svg", "drawing-assembly.dxf", "cover.stl"))
    path = out / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    report["design"] = with_former_defaults(report["design"])
    path.write_text(json.dumps(with_digest(report)), encoding="utf-8")
    second_command(Design(), out)
    names = {path.name for path in out.iterdir()}
    assert "cover.stl" in names
    assert not [name for name in names if name.startswith("drawing-")]
    assert others_of(out) == 0.0
