"""The decks that a user gets run in CalculiX as they are, and give the numbers that stand in them."""

import re
import shutil
import subprocess

import numpy as np
import pytest

from pipeline.cli import main
from pipeline.options import load_design
from pipeline.view.calculix_decks import _contact

needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
SPHERE = {"fruit.shape": "sphere", "fruit.radius_mm": "35"}
APART = 1e-6  # 1e-4 %
TABLE = r"{} .*for set {} and time.*\n\n((?:.+\n)+)"


@pytest.fixture(scope="module")
def decks(stand_in_folder, tmp_path_factory):
    folder = tmp_path_factory.mktemp("decks")
    assert main(["view", str(stand_in_folder), "--inp", str(folder)]) == 0
    return folder


def tables(folder, name, kind, node_set):
    """Run a deck and return the tables of a set, one for each step; an exit code of 0 says nothing here."""
    ran = subprocess.run(["ccx", "-i", name], cwd=folder, capture_output=True, text=True, check=True, timeout=600)
    assert "Job finished" in ran.stdout
    assert "*ERROR" not in ran.stdout
    text = (folder / f"{name}.dat").read_text(encoding="ascii")
    found = re.findall(TABLE.format(kind, node_set), text)
    return [np.array([line.split() for line in body.splitlines()], dtype=float) for body in found]


def stated(folder, name, words):
    """Return the numbers that stand before words in the heading of a deck."""
    heading = (folder / f"{name}.inp").read_text(encoding="ascii").partition("*NODE")[0]
    return [float(number) for number in re.findall(rf"(-?[\d.]+(?:e-?\d+)?) {words}", heading)]


@needs_ccx
def test_stiffness_of_both_springs_is_calculix_s(decks):
    wanted = stated(decks, "flexure", r"N/mm of the")
    text = (decks / "flexure.inp").read_text(encoding="ascii")
    loads = [np.array(re.findall(r"^(\d+), 3, (\S+)$", step.partition("*NODE PRINT")[0], re.MULTILINE), dtype=float)
             for step in text.split("*CLOAD, OP=NEW")[1:]]  # fmt: skip
    found = []
    for table, load in zip(tables(decks, "flexure", "displacements", "TIPS"), loads, strict=True):
        u = dict(zip(table[:, 0], table[:, 3], strict=True))
        assert 2.0 * load[:, 1].sum() == pytest.approx(1.0, rel=1e-9)  # the half of 1 N on half of the part
        found.append(1.0 / sum(2.0 * force * u[node] for node, force in load))
    print("stiffness, CalculiX over ours:", 100.0 * (np.array(found) / wanted - 1.0), "%")
    assert found == pytest.approx(wanted, rel=APART)


@needs_ccx
def test_force_on_the_fruit_is_calculix_s(decks):
    wanted = stated(decks, "contact", "N in step")
    found = [table[0, 2] for table in tables(decks, "contact", "total force", "HIGH_TIP")]
    supports = [tables(decks, "contact", "total force", f"SUPPORT{step}")[0][0, 2] for step in (0, 1)]
    print("force, CalculiX over ours:", 100.0 * (np.array(found) / wanted - 1.0), "%")
    assert found == pytest.approx(wanted, rel=APART)
    assert found == pytest.approx([-support for support in supports], rel=1e-5)


def test_decks_are_the_same_bytes_every_time(decks, stand_in_folder, tmp_path):
    assert main(["view", str(stand_in_folder), "--inp", str(tmp_path)]) == 0
    for name in ("flexure.inp", "contact.inp"):
        assert (tmp_path / name).read_bytes() == (decks / name).read_bytes()


def test_changed_deck_is_not_replaced(decks, stand_in_folder, tmp_path, capsys):
    shutil.copytree(decks, tmp_path / "mine")
    path = tmp_path / "mine" / "contact.inp"
    path.write_text("** mine\n" + path.read_text(encoding="ascii"), encoding="ascii")
    assert main(["view", str(stand_in_folder), "--inp", str(tmp_path / "mine")]) == 2
    assert "'contact.inp' is none" in capsys.readouterr().err


@pytest.mark.parametrize("settings", [{}, {"tips.shape": "cylinder"}, SPHERE])
def test_contact_is_written_where_tips_are_flat_squares_on_a_block(settings):
    assert (_contact(load_design("paper", settings)) is None) == bool(settings)


def test_contact_of_tips_off_the_middle_is_the_half_block():
    text = _contact(load_design("paper", {"tips.offset_mm": "1"}))
    assert "Half y >= 0." in text
    assert "NSET=LOW_TIP" in text
