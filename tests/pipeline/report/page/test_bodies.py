"""Bodies of the page: colours of a scale, the skin where closed forms say what it is."""

from types import SimpleNamespace

import numpy as np
import pytest
from squares import GENTLE
from stand_ins import springs_of

from mesh.housing.sweep import flexure_mesh
from pipeline.making.fields import fields_at_full_travel
from pipeline.options import RunOptions
from pipeline.report.page import bodies
from pipeline.report.page.bodies import (
    STRESS_OFF,
    _skin_fall,
    deformation_factor,
    flexure_body,
    loaded_half,
    palette_colours,
    skin_body,
)
from pipeline.report.report import read_report
from pipeline.response.scene_press import scene_of
from pipeline.springs.mounts import attached_to
from sensor.design.parameters import Design
from sensor.theory import hertz
from solve.housing.clamped_half import clamped_half

DOMES = SimpleNamespace(design=GENTLE)
"""What the skin under domes asks of a report."""


def test_colours_run_from_dark_to_bright_and_are_cut_at_the_ends():
    """Relative luminance of IEC 61966-2-1 rises with the value: the scale reads without hue."""
    colours = palette_colours(np.linspace(-1.0, 11.0, 25), 0.0, 10.0)
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    luminance = linear @ np.array([0.2126, 0.7152, 0.0722])
    assert (np.diff(luminance[2:-2]) > 0.0).all()
    np.testing.assert_allclose(colours[:3], np.broadcast_to(np.array([0x44, 0x01, 0x54]) / 255.0, (3, 3)))
    np.testing.assert_allclose(colours[-3:], np.broadcast_to(np.array([0xFD, 0xE7, 0x25]) / 255.0, (3, 3)))


@pytest.mark.parametrize("name", ["flat", "domes"])
def test_skin_is_that_of_a_point_force_far_away(name, flat_page):
    """Boussinesq: u = (1 - nu^2) F / (pi E r); the next term of a spread load is below (a / r)^2."""
    report = flat_page.report if name == "flat" else DOMES
    E, force = 2.0, 0.7
    distance = np.array([50.0, 100.0])
    nu = report.design.fruit.poisson
    expected = (1.0 - nu**2) * force / (np.pi * E * distance)
    np.testing.assert_allclose(_skin_fall(report, E, force, distance), expected, rtol=2e-3)


def test_flat_tip_pushes_all_under_it_as_far(flat_page):
    """A flat circle: u = (1 - nu^2) F / (2 a E), K. L. Johnson (3.36)."""
    report = flat_page.report
    a = np.sqrt(report.design.tips.face_mm2 / np.pi)
    nu = report.design.fruit.poisson
    fall = _skin_fall(report, 2.0, 0.7, np.array([0.0, 0.5 * a, a]))
    np.testing.assert_allclose(fall, (1.0 - nu**2) * 0.7 / (2.0 * a * 2.0), rtol=1e-12)


def test_dome_pushes_the_middle_by_the_approach():
    """Hertz: u(0) = a^2 / R, and half of it at the rim; K. L. Johnson (3.41), (4.22)."""
    report = DOMES
    fruit, tips = report.design.fruit, report.design.tips
    R = hertz.mean_relative_radius(tips.dome_radius_mm, *fruit.radii_mm)
    a = hertz.contact_radius(0.7, 2.0, fruit.poisson, R)
    fall = _skin_fall(report, 2.0, 0.7, np.array([0.0, a]))
    np.testing.assert_allclose(fall, [a**2 / R, 0.5 * a**2 / R], rtol=1e-12)


def test_skin_has_a_label_for_each_tip(flat_page):
    body = skin_body(flat_page.report, scene_of(flat_page.report.design))
    assert [label["text"] for label in body["labels"]] == [tip.name for tip in flat_page.report.tips]
    assert body["legend"]["low"] == 0.0 < body["legend"]["high"] <= flat_page.report.design.press.travel_mm


def test_flat_tip_beside_its_face(flat_page):
    """A flat circle outside: u = (1 - nu^2) F / (pi a E) arcsin(a / r), K. L. Johnson (3.38)."""
    report = flat_page.report
    a = np.sqrt(report.design.tips.face_mm2 / np.pi)
    expected = (1.0 - report.design.fruit.poisson**2) * 0.7 / (np.pi * a * 2.0) * np.arcsin(0.5)
    np.testing.assert_allclose(_skin_fall(report, 2.0, 0.7, np.array([2.0 * a])), expected, rtol=1e-12)
    assert _skin_fall(report, 2.0, 0.0, np.array([a])) == 0.0


def test_skin_under_the_tips(flat_page, monkeypatch):
    """Both tips of the default design stand on it, and what each pushes down adds up at every point."""
    drawn = []
    monkeypatch.setattr(bodies, "glb_of", lambda parts: drawn.extend(parts) or b"")
    report = flat_page.report
    legend = skin_body(report, scene_of(report.design))["legend"]
    (skin,) = drawn
    row = report.response[-1]
    fall = sum(
        _skin_fall(report, row.E_MPa, force, np.hypot(skin.vertices[:, 0] - x, skin.vertices[:, 1]))
        for x, force in zip((-4.0, 4.0), (row.F_l_N[-1], row.F_h_N[-1]), strict=True)
    )
    np.testing.assert_allclose(skin.moved, np.stack([0.0 * fall, 0.0 * fall, -fall], axis=1), atol=1e-15)
    assert legend["high"] == pytest.approx(fall.max(), rel=1e-12)
    np.testing.assert_array_equal(skin.vertices[:, 2], 0.0)  # a block is flat
    low, high = skin.vertices.min(axis=0), skin.vertices.max(axis=0)
    assert (low + high)[:2] == pytest.approx([0.0, 0.0], abs=1e-12)  # around the middle of the tips
    assert 4.0 < high[0] < 8.0
    corners = skin.vertices[skin.triangles][:, :, :2]
    sides = corners[:, 1:] - corners[:, :1]
    areas = 0.5 * (sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    assert areas.min() > 0.0  # every triangle looks up
    assert areas.sum() == pytest.approx(np.prod((high - low)[:2]), rel=1e-9)


@pytest.mark.parametrize(
    ("largest", "length", "factor"),
    [(1.0, 62.5, 5.0), (1.0, 62.4, 2.0), (8.0, 100.0, 1.0), (100.0, 10.0, 1.0), (0.0, 9.0, 1.0)],
)
def test_deformation_factor(largest, length, factor):
    """At most 0.08 of the length: 1, 2 or 5 times a power of ten."""
    assert deformation_factor(largest, length) == pytest.approx(factor, rel=1e-12)


@pytest.mark.slow
def test_legend_of_the_stress_ends_where_its_colours_end(default_run, monkeypatch):
    coloured = []

    def recorded(values, low, high):
        coloured.append((low, high, values.max()))
        return palette_colours(values, low, high)

    monkeypatch.setattr(bodies, "palette_colours", recorded)
    legend = flexure_body(read_report(default_run.folder), default_run.result)["legend"]
    assert coloured == [(legend["low"], legend["high"], legend["high"])]
    assert legend["limit"] > legend["high"]  # this design is far from it: a scale up to the limit would be another one


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [0.001, 0.02])
def test_largest_stress_of_the_picture_is_off_by_less_than_it_says(tolerance):
    """Compare with the mesh on which the springs are solved. A rough answer has a tolerance of 0.02."""
    springs = springs_of(Design())
    process = springs.process
    fine = clamped_half(flexure_mesh(springs.housing), process.E_MPa, process.poisson, attached_to(springs.housing))
    coarse = loaded_half(springs, RunOptions(tolerance=tolerance))
    stresses = [fields_at_full_travel(springs, half).von_mises.max() for half in (coarse, fine)]
    assert abs(stresses[0] / stresses[1] - 1.0) < STRESS_OFF
