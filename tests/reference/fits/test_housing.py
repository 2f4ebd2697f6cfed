"""Constants of the springs' error bars, on housings of all processes with springs near those of the default design."""

import dataclasses
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from covering import covers
from scipy.optimize import curve_fit

from cad.parts.layout import housing_for
from mesh.housing.sweep import flexure_mesh
from pipeline.errors.causes import FRAME_FRACTIONS
from pipeline.springs.leaf_lengths import COARSE, DEFAULT, MESH_PAIRS, coarse_lift
from sensor.design.parameters import Design, Print
from sensor.design.processes import PROCESSES
from solve.housing.stiffness import STRAIN_ERROR_SHARE, tip_compliance

pytestmark = pytest.mark.study

COARSE_LIFT = 5e-4  # of the stiffness: what the docstring of `coarse_lift` promises
RIGID_FROM = 2.5  # [mm] behind the leaf roots, where the letters L and H begin


@dataclass(frozen=True)
class Case:
    """The default design in a process with leaves of these lengths, low then high [mm], perhaps of another depth."""

    process_name: str
    lengths: tuple[float, float]
    depth: float | None = None

    @property
    def process(self):
        process = PROCESSES[self.process_name]
        return process if self.depth is None else dataclasses.replace(process, depth_mm=self.depth)

    @property
    def housing(self):
        design = Design(print=Print(process=self.process_name))
        return housing_for(design, self.process, self.lengths, (0.1, 0.1))  # stops do not move a stiffness

    def compliance(self, mesh):
        return tip_compliance(mesh, self.process.E_MPa, self.process.poisson)


PETG = Case("fdm-petg", (28.3, 14.0))
TITANIUM = Case("dmls-ti64", (56.0, 31.0))
EVERY = (
    PETG,
    TITANIUM,
    Case("fdm-pla", (34.0, 16.5)),
    Case("sls-pa12", (26.6, 13.0)),
    Case("sla-resin", (27.0, 13.0)),
    Case("dmls-17-4ph", (70.0, 37.0)),
)
# Leaves as thick as deep, and leaves deeper than long.
ODD = (
    Case("fdm-petg", (20.0, 10.0), depth=1.2),
    Case("fdm-petg", (20.0, 12.0), depth=2.5),
    Case("fdm-petg", (12.0, 8.0), depth=25.0),
    Case("fdm-petg", (16.0, 10.0), depth=40.0),
)


@cache
def mesh(case, scale):
    return flexure_mesh(case.housing, scale)


@cache
def solved(case, scale):
    return case.compliance(mesh(case, scale))


def stiffness(case, scale):
    return np.array(solved(case, scale).K)


def test_stiffness_on_the_coarse_mesh_is_lifted_as_the_fit_says():
    slenderness, measured, code = [], [], []
    for case in EVERY:
        slenderness.extend(np.array(case.lengths) / case.housing.depth)
        measured.extend(stiffness(case, COARSE) / stiffness(case, 1.0) - 1.0)
        code.extend(coarse_lift(arm.flexure) - 1.0 for arm in case.housing.arms)

    def law(x, a, b):
        return a / (1.0 + b * x)

    slenderness, measured, code = map(np.array, (slenderness, measured, code))
    (a, b), _ = curve_fit(law, slenderness, measured, p0=(3e-3, 0.5))
    fit = law(slenderness, a, b)
    assert np.abs(code - fit).max() <= np.abs(measured - fit).max()
    assert covers(COARSE_LIFT, np.abs(measured - code))


@pytest.mark.parametrize(
    ("pair", "cases", "reference"),
    [(MESH_PAIRS[0], EVERY, 1.0), (MESH_PAIRS[0], ODD, 1.0), (DEFAULT, (TITANIUM,), 0.5)],
    ids=["cheapest pair", "odd shapes", "default pair"],
)
def test_bar_of_a_pair_of_meshes_is_filled_by_the_error_against_a_finer_one(pair, cases, reference):
    filled = []
    for case in cases:
        found = pair.stiffness_with_errors(case.housing, solved(case, pair.fine), solved(case, pair.coarse))
        filled.extend(np.abs(np.array(found.K) / stiffness(case, reference) - 1.0) / found.error)
    assert covers(1.0, filled)


def test_strain_at_the_roots_is_known_to_a_share_of_what_continuing_it_adds():
    fine = solved(TITANIUM, 1.0)
    truth = np.array(solved(TITANIUM, 0.5).strain_per_N)
    strain = np.array(fine.strain_per_N)
    assert covers(STRAIN_ERROR_SHARE, np.abs(strain - truth) / (strain - fine.strain_inside_per_N))


def test_frame_adds_its_fraction_of_the_compliance():
    """Rigid is what may carry marks: the bar above the cavity, and the walls behind the leaf roots."""
    case = Case("fdm-petg", (25.9, 12.95), depth=6.0)  # 0.74 and 17.7 N/mm, near the paper's 0.753 and 17.3
    scale = 0.66  # the coarsest mesh with a line of nodes between leaf root and holes
    real = mesh(case, scale)
    x, _, z = real.p[:, real.t].mean(axis=1)
    left, right = (arm.wall for arm in case.housing.arms)
    frame = np.flatnonzero((x < left - RIGID_FROM) | (x > right + RIGID_FROM) | (z > case.housing.cavity_level))
    held = np.union1d(real.boundaries["mounting_holes"], real.t2f[:, frame])
    rigid = np.array(case.compliance(real.with_boundaries({**real.boundaries, "mounting_holes": held})).K)
    K = stiffness(case, scale)
    scaled = (1.0 - K / rigid) * case.process.E_MPa * case.housing.depth / K
    for constant, seen in zip(FRAME_FRACTIONS, scaled, strict=True):
        assert covers(constant, [seen])
