"""The mounts of a design against CalculiX on tetrahedra of its solids, covers and all: stiffnesses and modes."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from reference.mounted_tetrahedra import mounted_tetrahedra
from stand_ins import PETG, default_housing

from benchmarks.calculix import is_installed
from benchmarks.deck import boundary_sets, peer_elements, write_model
from benchmarks.flexure import peer_stiffness
from cad.parts.cover import WASHER_MM, Cover
from cad.parts.cover_solid import cover_part
from cad.parts.housing import Housing
from cad.parts.housing_solid import housing_part
from mesh.housing.sweep import flexure_mesh
from pipeline.springs.mounts import attached_to
from solve.error_estimate import richardson
from solve.housing.modes import Solid, housing_modes
from solve.housing.stiffness import tip_compliance

pytestmark = [pytest.mark.study, pytest.mark.skipif(not is_installed(), reason="CalculiX is not installed")]

MATERIAL = (PETG.E_MPa, PETG.poisson)
SIZES, RATE = (1.2, 0.9), 2.5  # of tetrahedra, and how their error falls: reference/flexure_reference.py
APART = 3e-3  # of a stiffness, between the product and CalculiX
MODES_APART, TETS_HIGH = 1e-2, 4e-3  # of a frequency, and how far tetrahedra that are not carried on lie high


def mounted(mount: str) -> Housing:
    return replace(default_housing(), mount=mount)


def solids(housing: Housing, size: float):
    """Return the tetrahedra of the housing in its mount [mm]."""
    if housing.mount == "washers":
        return mounted_tetrahedra(housing_part(housing), housing, size, None, WASHER_MM)
    cover = cover_part(Cover(housing=housing, foot_level=housing.cover_level))
    return mounted_tetrahedra(housing_part(housing), housing, size, cover)


def extrapolated(housing: Housing) -> np.ndarray:
    """Return the stiffnesses [N/mm] that CalculiX finds on two meshes of the solids, carried on to size zero."""
    found = [peer_stiffness(solids(housing, size), ("tet P2", "C3D10"), MATERIAL)[0] for size in SIZES]
    return np.array([richardson(values, SIZES, RATE).value for values in np.transpose(found).tolist()])


@pytest.mark.parametrize("mount", ["covers", "washers"])
def test_stiffness_in_each_mount_is_that_of_its_solids(mount):
    housing = mounted(mount)
    mesh, truth = flexure_mesh(housing), extrapolated(housing)
    apart = np.array(tip_compliance(mesh, *MATERIAL, attached_to(housing)).K) / truth - 1.0
    print(mount, truth, 100.0 * apart, "%", flush=True)
    assert np.all(np.abs(apart) < APART)
    if mount == "covers":
        clamped = np.array(tip_compliance(mesh, *MATERIAL).K) / truth - 1.0
        assert clamped[1] > APART  # the holes held all around: a mount that is not on the sheet


def test_modes_are_those_of_the_solids_between_their_covers(tmp_path):
    housing = mounted("covers")
    K = tip_compliance(flexure_mesh(housing), *MATERIAL, attached_to(housing)).K
    solid = Solid(E=MATERIAL[0], poisson=MATERIAL[1], density=PETG.density_g_per_cm3)
    found = housing_modes(flexure_mesh(housing, 4.0), solid, K, attached_to(housing))
    truth = calculix_modes(solids(housing, SIZES[0]), tmp_path)[: len(found.frequencies_Hz)]
    print(found, truth)
    apart = np.abs(np.array(found.frequencies_Hz) / truth - 1.0)
    assert np.all(apart < MODES_APART)
    assert np.all(apart < np.add(found.errors, TETS_HIGH))


def calculix_modes(mesh, folder: Path) -> np.ndarray:
    """Return the lowest frequencies [Hz] of the half with either symmetry about y = 0, by CalculiX."""
    elements = peer_elements(mesh, "tet P2", "C3D10")
    sets = boundary_sets(elements, mesh, "tet P2", ("mounting_holes", "symmetry"))
    frequencies = []
    for name, components in (("even", (2,)), ("odd", (1, 3))):
        with (folder / f"{name}.inp").open("w", encoding="ascii") as file:
            write_model(file, elements, sets, *MATERIAL)
            # Properties of the last material: *SOLID SECTION ends its block, so the density comes with its own.
            held = [("MOUNTING_HOLES", component) for component in (1, 2, 3)]
            held += [("SYMMETRY", component) for component in components]
            file.write("*BOUNDARY\n" + "".join(f"{which}, {c}, {c}\n" for which, c in held))
            file.write("*STEP\n*FREQUENCY\n4\n*END STEP\n")
        text = (folder / f"{name}.inp").read_text(encoding="ascii")
        density = f"*DENSITY\n{1e-9 * PETG.density_g_per_cm3:.6e}\n*SOLID SECTION"
        (folder / f"{name}.inp").write_text(text.replace("*SOLID SECTION", density), encoding="ascii")
        subprocess.run([shutil.which("ccx"), "-i", name], cwd=folder, check=True, capture_output=True, timeout=600)
        rows = re.findall(r"^ +\d+ +\S+ +\S+ +(\S+) +\S+$", (folder / f"{name}.dat").read_text(), re.MULTILINE)
        frequencies += [float(row) for row in rows[:4]]
    return np.sort(frequencies)
