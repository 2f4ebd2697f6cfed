"""What a notebook shows of a result and of a report: the answer, the verdicts, the springs and a plot."""

import dataclasses
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from stand_ins import result_of, springs_of

from pipeline.notebook import answer_html
from pipeline.report.of_result import report_of_result
from sensor.design.parameters import Design
from sensor.words import OUTCOMES

SVG = "{http://www.w3.org/2000/svg}"
E = np.linspace(0.5, 3.5, 7)  # [MPa]


def points_of(line):
    return [tuple(map(float, pair.split(","))) for pair in line.get("points").split()]


def drawn(P, moduli=()):
    return ET.fromstring(answer_html("mine", [], {}, E, np.asarray(P), moduli))


def test_result_shows_what_its_report_shows():
    result = result_of()
    assert report_of_result(result)._repr_html_() == result._repr_html_()


def test_verdicts_springs_and_moduli_of_a_result_are_shown_and_no_options():
    result = result_of()
    first, *rest = result.verdicts
    result = dataclasses.replace(result, verdicts=(dataclasses.replace(first, passed=False, remedy="<b>"), *rest))
    shown = ET.fromstring(result._repr_html_())
    verdicts, springs = shown.findall("table")
    on_target = {verdict.name: OUTCOMES[verdict.passed] for verdict in result.verdicts if verdict.row.group == "target"}
    *rows, others = verdicts.findall("tr")[1:]
    assert {row.find("td").text: row.findall("td")[-1].find("span").text for row in rows} == on_target
    assert int(others.find("td").text.split()[0]) == len(result.verdicts) - len(on_target)
    assert [item.find("span").tail for item in shown.iter("li")] == [f" {first.name}: <b>"]
    assert [row.find("td").text for row in springs.findall("tr")[1:]] == ["low", "high"]
    assert len(list(shown.iter(f"{SVG}circle"))) == len(result.design.fruit.E_MPa)


def test_curve_is_to_scale():
    """P = 2 E is a straight line in every scale, through the dots of the design's moduli."""
    shown = drawn(2.0 * E, [1.0, 3.0])
    (line,) = shown.iter(f"{SVG}polyline")
    points = np.array(points_of(line))
    assert points[0, 0] < points[-1, 0]
    assert points[0, 1] > points[-1, 1]
    dots = [(float(dot.get("cx")), float(dot.get("cy"))) for dot in shown.iter(f"{SVG}circle")]
    for parts, found in ((np.linspace(0.0, 1.0, E.size), points), (np.array([1.0 / 6.0, 5.0 / 6.0]), dots)):
        straight = points[0] + parts[:, None] * (points[-1] - points[0])
        np.testing.assert_allclose(found, straight, atol=0.1)  # [px] of one decimal, at both ends


@pytest.mark.parametrize(
    ("P", "lengths"),
    [
        ([1.0, 2.0, np.nan, 3.0, 4.0, 5.0, 6.0], [2, 4]),
        ([np.nan, np.nan, 2.0, 3.0, 4.0, np.nan, np.nan], [3]),
        ([3.0] * 7, [7]),
        ([np.nan] * 7, []),
    ],
)
def test_curve_is_broken_where_a_tip_is_off(P, lengths):
    shown = drawn(P, [1.5])
    assert [len(points_of(line)) for line in shown.iter(f"{SVG}polyline")] == lengths
    assert len(list(shown.iter(f"{SVG}circle"))) == int(np.isfinite(P[2]))


def test_springs_that_are_not_made_and_names_of_a_user_are_shown():
    shown = ET.fromstring(answer_html("<b>", [], springs_of(Design(), made=False).springs, E, E, []))
    assert "<b>" in shown.find("p/strong").text
    assert [row.findall("td")[-1].text for row in shown.findall("table")[-1].findall("tr")[1:]] == [None, None]
