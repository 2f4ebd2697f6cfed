"""Scenes show the whole of a half model, the true shape of a fruit, and colours from the very numbers of the files."""

import dataclasses

import numpy as np
import pytest
import pyvista as pv
from view_stand_ins import DEPTH, LENGTH, beam_fields, half_beam

from cad.design.design_file import design_from_mapping
from cad.design.processes import PROCESSES
from pipeline.options import load_design
from pipeline.report.stored import read_report
from pipeline.view.loaded_sensor import as_drawn
from pipeline.view.pictures import field_scenes
from pipeline.view.scenes.field import (
    FLEXURE_FIELDS,
    LARGEST_STRAIN,
    SHARE_OF_LIMIT,
    TOTAL_DISPLACEMENT,
    VERTICAL_PRESSURE,
    VON_MISES,
)
from pipeline.view.scenes.fruit import on_true_shape
from pipeline.view.scenes.mirrored import whole_model
from pipeline.view.scenes.scene import Cut, deformed_surface, draw_scene
from pipeline.view.scenes.stage import rule_length

DIGITS = 2.0**-19  # of a value in a VTU file, relative to the largest


@pytest.fixture(scope="module")
def half():
    mesh = half_beam()
    return as_drawn(mesh, beam_fields(mesh))


def at(mesh, place):
    """Return the number of the node at a place [mm]."""
    node = mesh.find_closest_point(place)
    np.testing.assert_allclose(mesh.points[node], place, atol=1e-9)
    return node


def test_mirrored_half_is_the_whole_body(half):
    whole = whole_model(half)
    assert whole.volume == pytest.approx(2.0 * LENGTH * DEPTH, rel=DIGITS)
    assert whole.bounds[2:4] == pytest.approx((-DEPTH, DEPTH))
    assert whole.n_points == 2 * half.n_points - int(np.sum(half.point_data["symmetry"]))
    # its surface has no wall in the plane of symmetry, and no cell is inside out
    assert whole.extract_surface(algorithm="dataset_surface").area == pytest.approx(2 * (2 * 1 + 2 * 10 + 1 * 10))
    assert whole.compute_cell_sizes()["Volume"].min() > 0.0


def test_vectors_and_tensors_are_mirrored(half):
    """Y and what has one y among its indices change their sign: xx, yy, zz, xy, yz, xz."""
    whole = whole_model(half)
    here, there = (at(whole, (LENGTH / 2, side * DEPTH, 1.0)) for side in (1.0, -1.0))
    u, sigma = whole.point_data["displacement_mm"], whole.point_data["stress_MPa"]
    assert u[here, 1] != 0.0
    np.testing.assert_array_equal(u[there], u[here] * (1, -1, 1))
    np.testing.assert_array_equal(sigma[there], sigma[here] * (1, 1, 1, -1, -1, 1))
    np.testing.assert_array_equal(whole.point_data["von_mises_MPa"][there], whole.point_data["von_mises_MPa"][here])


def test_quadratic_cells_are_mirrored_right_side_out():
    cell = pv.examples.cells.QuadraticHexahedron()
    cell.points[:, 1] -= cell.points[:, 1].min()
    cell.point_data["symmetry"] = (cell.points[:, 1] == 0.0).astype(np.int8)
    whole = whole_model(cell)
    assert whole.n_cells == 2
    assert whole.volume == pytest.approx(2.0 * cell.volume, rel=DIGITS)
    for number, edge in ((8, (0, 1)), (13, (5, 6)), (16, (0, 4))):  # middles of edges, by VTK's figure
        nodes = whole.cells_dict[int(pv.CellType.QUADRATIC_HEXAHEDRON)][1]
        middle = whole.points[nodes[list(edge)]].mean(axis=0)
        assert np.linalg.norm(whole.points[nodes[number]] - middle) < 0.2


def test_mesh_without_a_plane_of_symmetry_stays(half):
    bare = half.copy()
    del bare.point_data["symmetry"]
    assert whole_model(bare) is bare


def test_each_spring_has_its_own_side_and_its_own_range(stand_in_folder):
    """The stand-in's numbers are 1 and 2 times the distance from the middle."""
    report = read_report(stand_in_folder)
    low, high, _ = field_scenes(report, stand_in_folder)
    assert (low.mesh.bounds[0], low.mesh.bounds[1]) == pytest.approx((-5.0, 0.0))
    assert (high.mesh.bounds[0], high.mesh.bounds[1]) == pytest.approx((0.0, 5.0))
    assert low.fields == high.fields == FLEXURE_FIELDS
    limit = PROCESSES[report.design.print.process].strain_limit
    for scene, factor in ((low, 1.0), (high, 2.0)):
        largest = factor * 5.0
        assert VON_MISES.range_on(scene.mesh) == pytest.approx((0.0, largest), rel=DIGITS)
        assert SHARE_OF_LIMIT.range_on(scene.mesh) == pytest.approx((0.0, 1e-4 * largest / limit), rel=DIGITS)
        assert scene.largest_displacement_mm == pytest.approx(np.hypot(1e-2, 1e-3) * largest, rel=DIGITS)


def test_bar_of_colours_has_the_range_of_the_file(stand_in_folder):
    *_, fruit = field_scenes(read_report(stand_in_folder), stand_in_folder)
    written = pv.read(stand_in_folder / "fruit.vtu")
    plotter = pv.Plotter(off_screen=True)
    try:
        draw_scene(plotter, fruit, VON_MISES)
        ((title, bar),) = plotter.scalar_bars.items()
        assert "von Mises stress [MPa]" in title
        shown = bar.GetLookupTable().GetTableRange()
        assert shown == (0.0, float(written.point_data["von_mises_MPa"].max()))
    finally:
        plotter.close()


def test_two_scenes_in_one_window_have_two_bars(stand_in_folder):
    """VTK takes bars of one title for one bar: that emptied all parts of the window but one."""
    low, high, _ = field_scenes(read_report(stand_in_folder), stand_in_folder)
    plotter = pv.Plotter(off_screen=True, shape=(1, 2))
    try:
        for column, scene in enumerate((low, high)):
            plotter.subplot(0, column)
            draw_scene(plotter, scene)
        ranges = [bar.GetLookupTable().GetTableRange()[1] for bar in plotter.scalar_bars.values()]
        assert ranges == pytest.approx([5.0, 10.0], rel=DIGITS)
    finally:
        plotter.close()


def test_pressure_is_the_stress_along_the_press(stand_in_folder):
    *_, fruit = field_scenes(read_report(stand_in_folder), stand_in_folder)
    assert fruit.fields[0] == VERTICAL_PRESSURE
    np.testing.assert_allclose(
        fruit.mesh.point_data[VERTICAL_PRESSURE.array], -fruit.mesh.point_data["stress_MPa"][:, 2]
    )
    u = np.linalg.norm(fruit.mesh.point_data["displacement_mm"], axis=1)
    np.testing.assert_allclose(fruit.mesh.point_data[TOTAL_DISPLACEMENT.array], u)


def test_cut_takes_away_what_lies_before_it(stand_in_folder):
    *_, fruit = field_scenes(read_report(stand_in_folder), stand_in_folder)
    before, _ = deformed_surface(fruit)
    assert before.bounds[2] == pytest.approx(0.0)  # through the row of tips, y = 0
    assert before.bounds[3] == pytest.approx(10.0)
    whole, _ = deformed_surface(dataclasses.replace(fruit, cut=None))
    assert whole.bounds[2] == pytest.approx(-10.0)
    moved = dataclasses.replace(fruit, cut=Cut(origin=(2.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)))
    assert deformed_surface(moved)[0].bounds[1] == pytest.approx(2.0)


def test_sphere_is_drawn_as_a_sphere():
    """A piece of radius R falls by R - sqrt(R^2 - r^2) at a distance r from its apex; its base stays flat."""
    design, radius = load_design("mango", {}), 35.0
    fruit = design.fruit
    assert fruit.radius_mm == radius
    lines = [np.linspace(-12.0, 12.0, 9), np.linspace(-12.0, 12.0, 9), np.linspace(-12.0, 0.0, 4)]
    block = pv.RectilinearGrid(*lines).cast_to_unstructured_grid()
    bent = on_true_shape(design, block)
    top, base = (np.isclose(block.points[:, 2], level) for level in (0.0, -12.0))
    r = np.hypot(*block.points[top, :2].T)
    np.testing.assert_allclose(bent.points[top, 2], -(radius - np.sqrt(radius**2 - r**2)), atol=1e-9)
    np.testing.assert_allclose(bent.points[base, 2], -12.0)
    flat = design_from_mapping({"name": "flat"})
    np.testing.assert_array_equal(on_true_shape(flat, block).points, block.points)


@pytest.mark.parametrize(("width", "length"), [(40.0, 10.0), (39.0, 5.0), (1.0, 0.2), (0.5, 0.1)])
def test_rule_has_a_round_length_of_at_most_a_quarter(width, length):
    assert rule_length(width) == pytest.approx(length)


@pytest.mark.slow
def test_ranges_of_a_run_are_the_numbers_of_its_report(run_with_fields):
    """Root strain and displacement of each spring lie within the errors that the report prints."""
    report = read_report(run_with_fields)
    low, high, fruit = field_scenes(report, run_with_fields)
    limit = PROCESSES[report.design.print.process].strain_limit
    for scene, name, deflection in zip((low, high), ("low", "high"), report.deflections_mm, strict=True):
        spring = report.springs[name]
        _, strain = LARGEST_STRAIN.range_on(scene.mesh)
        assert strain == pytest.approx(spring.root_strain, rel=0.01 * spring.root_strain_error_percent)
        assert SHARE_OF_LIMIT.range_on(scene.mesh)[1] == pytest.approx(strain / limit, rel=DIGITS)
        # the face of a tip also tilts, by less than a hundredth of the way
        assert scene.largest_displacement_mm == pytest.approx(deflection, rel=0.01)
    whole = pv.read(run_with_fields / "flexure.vtu")
    ends = [VON_MISES.range_on(scene.mesh)[1] for scene in (low, high)]
    assert max(ends) == float(whole.point_data["von_mises_MPa"].max())
    # the deeper tip goes in by the travel less what its spring gives
    travel = report.design.press.travel_mm
    forces = zip(("low", "high"), report.response[-1].kind_forces, strict=True)
    depths = [travel - 1e3 * force[-1] / report.springs[name].stiffness_N_per_m for name, force in forces]
    assert fruit.largest_displacement_mm == pytest.approx(max(depths), rel=0.02)
