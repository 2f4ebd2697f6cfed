"""Sideways stiffness as a verdict: what passes, what a thin plate does, what an error bar leaves open."""

from pathlib import Path

import pytest
from stand_ins import draw_sensor, springs_of

from pipeline.making import fabrication
from pipeline.making.fabrication import begin_fabrication, sideways_verdict, sideways_verdicts
from pipeline.options import RunOptions
from pipeline.springs.fitted_springs import height_difference_down
from pipeline.storage.kept_files import KeptFiles
from sensor.design.parameters import Design
from sensor.design.reading import ReadingRequirements

SPRINGS = springs_of(Design()).springs


@pytest.mark.parametrize(
    ("name", "ratio", "step", "passed"),
    [
        ("low", 3.2, 0.01, True),
        ("low", 2.9, 0.01, False),
        ("high", 1.78, 0.01, True),
        ("high", 0.70, 0.01, False),  # a plate 6 mm deep, by finite elements
        ("high", 1.205, 0.01, None),
    ],
)
def test_sideways_stiffness_against_its_least_share(name, ratio, step, passed):
    """Stiffness across and its error bar go over the stiffness along the press, of the spring as it was solved."""
    K = SPRINGS[name].stiffness
    verdict = sideways_verdict(name, SPRINGS[name], ratio * K, step * K)
    assert (verdict.name, verdict.passed) == (f"sideways.{name}", passed)
    assert (verdict.value, verdict.error) == pytest.approx((ratio, step), rel=1e-12)


@pytest.mark.parametrize(("made", "fabrication"), [(True, False), (False, True)])
def test_nothing_is_made_unasked_or_where_no_housing_is(made, fabrication):
    options, springs = RunOptions(fabrication=fabrication), springs_of(Design(), made=made)
    assert begin_fabrication(draw_sensor(Design(), springs), options, None).result() == KeptFiles()
    assert sideways_verdicts(springs, options) == ()


def test_files_for_fabrication_are_those_of_their_folder(monkeypatch):
    """The sheet names the folder in its commands, so files that were made for another one are not taken again."""
    asked = []
    monkeypatch.setattr(fabrication, "begin_files", lambda *arguments: asked.append(arguments))
    sensor = draw_sensor(Design(), springs_of(Design()))
    folders = ("outputs/hx", "elsewhere")
    for folder in folders:
        begin_fabrication(sensor, RunOptions(fabrication=True, out=Path(folder)), None)
    assert [write.args[2].folder for _, _, write, _ in asked] == list(folders)
    assert asked[0][1] != asked[1][1]


@pytest.mark.parametrize(("reading", "presses"), [(None, 1), (ReadingRequirements(presses=4.0), 4)])
def test_sheet_knows_the_presses_of_the_design_and_the_heights_of_its_tips(reading, presses, monkeypatch):
    asked = []
    monkeypatch.setattr(fabrication, "begin_files", lambda *arguments: asked.append(arguments))
    design = Design(reading=reading)
    springs = springs_of(design)
    begin_fabrication(draw_sensor(design, springs), RunOptions(fabrication=True), None)
    read_out = asked[0][2].args[2]
    assert read_out.presses == presses
    assert read_out.height_difference_down == height_difference_down(springs)
