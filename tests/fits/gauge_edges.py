"""EDGE_STIFFNESS and EDGE_STRAIN: what both meshes leave to come at the edges of foils, over the step between them.

`python tests/fits gauge_edges` (1 minute): scales 2 and 1 against eight times the elements along the leaves.
"""

import dataclasses
from collections.abc import Sequence
from functools import cache
from unittest.mock import patch

import numpy as np
from fits.comparison import Comparison, covering
from fits.springs import Case

from mesh.housing.blocks import counts
from mesh.housing.sweep import flexure_mesh
from pipeline.springs.mounts import bonded_foils
from solve.housing.stiffness import EDGE_STIFFNESS, EDGE_STRAIN, TipCompliance, tip_compliance

PLASTIC = Case("fdm-petg", (32.0, 17.0), gauges="foil")
STEEL = Case("dmls-17-4ph", (70.0, 37.0), gauges="foil")
ALONG = 8
SPARE = 5.0  # one plastic housing fills a third to a fourth of what is left open


@cache
def left(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Return what is to come of compliance and strain over the step from the coarse mesh [1], each of shape (2,)."""
    coarse, fine, truth = (_solved(case, scale, times) for scale, times in ((2.0, 1), (1.0, 1), (1.0, ALONG)))
    of_compliance, of_strain = ((c - b) / (b - a) for a, b, c in zip(*map(_values, (coarse, fine, truth)), strict=True))
    return of_compliance, of_strain


def _values(result: TipCompliance) -> tuple[np.ndarray, np.ndarray]:
    return np.diag(result.C), np.array(result.gauge_strain_per_N)


def _solved(case: Case, scale: float, times: int) -> TipCompliance:
    housing, few = case.housing, counts(case.housing, scale)
    many = dataclasses.replace(few, along_leaf=times * few.along_leaf)
    with patch("mesh.housing.sweep.counts", lambda *_: many):
        mesh = flexure_mesh(housing, scale)
    return tip_compliance(mesh, case.process.E_MPa, case.process.poisson, bonded_foils(housing))


def compared(cases: Sequence[Case] = (PLASTIC,)) -> list[Comparison]:
    stiffness, strain = (np.concatenate(parts) for parts in zip(*map(left, cases), strict=True))
    return [
        covering(f"{name}: left open beside {taken:g}", still_open, np.abs(seen - taken), SPARE)
        for name, (taken, still_open), seen in (
            ("EDGE_STIFFNESS", EDGE_STIFFNESS, stiffness),
            ("EDGE_STRAIN", EDGE_STRAIN, strain),
        )
    ]
