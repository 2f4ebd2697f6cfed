"""The deck of a housing: what stands in it, and CalculiX finds the stiffness that a run reports."""

import dataclasses
import re
import shutil
import subprocess

import numpy as np
import pytest
from deadline import DEADLINE_S
from squares import square_housing
from stand_ins import PETG, default_housing

from mesh.housing.sweep import flexure_mesh
from pipeline.making.flexure_deck import NAME, flexure_deck
from pipeline.springs.mounts import mount_layers
from sensor.design.parameters import Design, Print
from solve.housing.clamped_half import clamped_half
from solve.housing.stiffness import compliance_of

COARSE = 4.0  # scale of the mesh
needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")


HOUSINGS = {
    "covers": default_housing,
    "washers": lambda: default_housing(Design(print=Print(mount="washers"))),
    "square": square_housing,
    "holes": lambda: dataclasses.replace(default_housing(), mount="holes"),
}


@pytest.fixture(scope="module", params=["covers", "washers", pytest.param("square", marks=pytest.mark.slow), "holes"])
def half(request):
    housing = HOUSINGS[request.param]()
    return clamped_half(flexure_mesh(housing, COARSE), PETG.E_MPa, PETG.poisson, mount_layers(housing))


def deck_of(half, **changes):
    return dataclasses.replace(flexure_deck(half, PETG.E_MPa, PETG.poisson), **changes)


def springs_written(text):
    """Return the stiffness matrix of the springs of a deck [N/mm], that of the ground as its last node."""
    nodes = max(int(number) for number in re.findall(r"^(\d+), [-+0-9.e]+, [-+0-9.e]+, ", text, flags=re.MULTILINE))
    matrix = np.zeros((nodes, nodes, 3))
    cards = r"\*ELEMENT, TYPE=SPRING2, ELSET=\S+\n((?:\d+, \d+, \d+\n)+)\*SPRING, ELSET=\S+\n(\d), \2\n(\S+)\n"
    for lines, axis, stiffness in re.findall(cards, text):
        for line in lines.splitlines():
            ends = [int(number) - 1 for number in line.split(", ")[1:]]
            matrix[np.ix_(ends, ends, [int(axis) - 1])] += float(stiffness) * np.array(
                [[[1.0], [-1.0]], [[-1.0], [1.0]]]
            )
    return matrix


def test_springs_have_the_matrix_of_the_layers_and_stand_on_the_side_face(half):
    """Each is written to six digits."""
    deck = deck_of(half)
    written = springs_written(deck.text())
    if half.ground is None:
        assert not written.any()
        return
    count = deck.elements.count
    for axis in range(3):
        layers = half.ground[axis::3, axis::3].toarray()
        assert np.abs(written[:count, :count, axis] - layers).max() < 1e-5 * layers.max()
    assert set(np.flatnonzero(written[:count, :count].any(axis=(1, 2)))) <= set(deck.sets["side_faces"])
    assert deck.sets["ground"].tolist() == [count]


def test_means_weigh_the_nodes_of_their_tip(half):
    deck = deck_of(half)
    for name, mean in deck.means.items():
        assert mean.sum() == pytest.approx(1.0, rel=1e-9)
        assert set(np.flatnonzero(mean)) <= set(deck.sets[name.removesuffix("_mean")])


def calculix_stiffnesses(text, folder):
    """Return K of each tip [N/mm] as the heading of a deck says, read from flexure.dat."""
    (folder / NAME).write_text(text, encoding="ascii")
    command = ["ccx", "-i", NAME.removesuffix(".inp")]
    subprocess.run(command, cwd=folder, capture_output=True, timeout=DEADLINE_S, check=True)
    printed = (folder / "flexure.dat").read_text(encoding="ascii")
    tables = re.findall(r"for set (LOW|HIGH)_TIP_MEAN and time +(\S+)\n\n +\d+ +\S+ +\S+ +(\S+)", printed)
    moved = {(name, round(float(step))): float(u) for name, step, u in tables}
    return np.array([1.0 / moved["LOW", 1], 1.0 / moved["HIGH", 2]])


@pytest.mark.slow
@needs_ccx
def test_calculix_finds_the_stiffness_of_the_same_mesh(half, tmp_path):
    """CalculiX prints seven digits."""
    assert calculix_stiffnesses(deck_of(half).text(), tmp_path) == pytest.approx(compliance_of(half).K, rel=2e-6)


@pytest.mark.slow
@needs_ccx
def test_deck_of_a_run_has_the_stiffness_of_its_report(default_run, fields_folder, tmp_path):
    text = (fields_folder / NAME).read_text(encoding="ascii")
    springs = default_run.result.springs
    K = np.array(springs.stiffnesses.stiffnesses)
    told = [float(number) for number in re.findall(r"K = (\S+) N/mm within", text)]
    assert told == pytest.approx(K, rel=1e-5)
    assert (np.abs(calculix_stiffnesses(text, tmp_path) - K) < springs.errors).all()
