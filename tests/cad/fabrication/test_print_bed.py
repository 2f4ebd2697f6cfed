"""The plate of all printed parts: parts apart, in rows; settings by process and leaves."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from cad.fabrication.print_bed import GAP_MM, arrange_on_bed, plate_size
from cad.files.slicer_settings import slicer_settings
from sensor.design.processes import PROCESSES

PETG = PROCESSES["fdm-petg"]


@pytest.mark.parametrize("longest", [40.0, 150.0, 300.0])
def test_parts_lie_apart_in_rows(rng, longest):
    meshes = {}
    for number in range(8):
        size = rng.uniform(5.0, longest, 3)
        meshes[str(number)] = trimesh.creation.box(size).apply_translation(rng.uniform(-50.0, 50.0, 3))
    counts = {name: 1 + int(name) % 3 for name in meshes}
    placed = arrange_on_bed(meshes, counts)
    assert len(placed) == sum(counts.values())
    volumes = sum(counts[name] * mesh.volume for name, mesh in meshes.items())
    assert sum(mesh.volume for mesh in placed.values()) == pytest.approx(volumes)
    low, high = np.array([mesh.bounds[:, :2] for mesh in placed.values()]).transpose(1, 0, 2)
    assert low.min() > GAP_MM - 1e-9
    assert plate_size(placed.values()) == pytest.approx(tuple(high.max(axis=0) - low.min(axis=0)))
    for one, other in itertools.combinations(range(len(low)), 2):
        assert max((low[other] - high[one]).max(), (low[one] - high[other]).max()) > GAP_MM - 1e-9
    assert high.max() < max(2.0 * np.prod(high - low, axis=1).sum() ** 0.5, 2.0 * longest)


@pytest.mark.parametrize(("thickness", "perimeters"), [(0.4, "1"), (0.8, "1"), (1.2, "2"), (1.6, "2"), (2.0, "3")])
def test_perimeters_fill_the_thickest_leaf_from_both_sides(housing, thickness, perimeters):
    leaf = replace(housing.high, thickness=thickness)
    thick = replace(housing, high=leaf, low=replace(housing.low, thickness=0.4))
    assert slicer_settings(PETG, thick)["perimeters"] == perimeters


def test_settings_are_those_of_the_process_and_of_no_process_without_lines(housing):
    sources = tuple((name, source) for name, source in PETG.sources if name != "layer_mm")
    other = replace(PETG, line_width_mm=0.6, layer_mm=None, sources=sources)
    settings = slicer_settings(other, housing)
    assert {value for key, value in settings.items() if key.endswith("width")} == {"0.6"}
    assert "layer_height" not in settings
    assert {name for name, process in PROCESSES.items() if slicer_settings(process, housing)} == {"fdm-petg", "fdm-pla"}
