"""Housings whose springs the scripts of this folder solve, each on as many meshes as they ask for."""

import dataclasses
from dataclasses import dataclass
from functools import cache

import numpy as np

from cad.design.parameters import Design, Print
from cad.design.processes import PROCESSES, Process
from cad.parts.housing import Housing
from cad.parts.layout import housing_for
from mesh.housing.sweep import FlexureMesh, flexure_mesh
from solve.housing.stiffness import TipCompliance, tip_compliance

_STOPS = (0.1, 0.1)  # [mm] deflections that the stops leave room for; they do not move a stiffness


@dataclass(frozen=True)
class Case:
    """The default design in a process with leaves of these lengths, low then high [mm], perhaps of another depth."""

    process_name: str
    lengths: tuple[float, float]
    depth: float | None = None
    gauges: str = "none"

    @property
    def process(self) -> Process:
        process = PROCESSES[self.process_name]
        return process if self.depth is None else dataclasses.replace(process, depth_mm=self.depth)

    @property
    def housing(self) -> Housing:
        design = Design(print=Print(process=self.process_name, gauges=self.gauges))
        return housing_for(design, self.process, self.lengths, _STOPS)

    def __str__(self) -> str:
        depth = "" if self.depth is None else f", {self.depth:g} mm deep"
        return f"{self.process_name} {self.lengths[0]:g}/{self.lengths[1]:g} mm{depth}"


# Lengths near 0.9 and 21 N/mm, the springs of the default design.
PETG = Case("fdm-petg", (28.3, 14.0))
TITANIUM = Case("dmls-ti64", (56.0, 31.0))
STEEL = Case("dmls-17-4ph", (70.0, 37.0))
EVERY = (
    PETG,
    Case("fdm-pla", (34.0, 16.5)),
    Case("sls-pa12", (26.6, 13.0)),
    Case("sla-resin", (27.0, 13.0)),
    STEEL,
    TITANIUM,
)
# Leaves as thick as deep, and leaves deeper than long.
ODD = (
    Case("fdm-petg", (20.0, 10.0), depth=1.2),
    Case("fdm-petg", (20.0, 12.0), depth=2.5),
    Case("fdm-petg", (12.0, 8.0), depth=25.0),
    Case("fdm-petg", (16.0, 10.0), depth=40.0),
)


@cache
def mesh(case: Case, scale: float) -> FlexureMesh:
    return flexure_mesh(case.housing, scale)


@cache
def solved(case: Case, scale: float) -> TipCompliance:
    return tip_compliance(mesh(case, scale), case.process.E_MPa, case.process.poisson)


def stiffness(case: Case, scale: float) -> np.ndarray:
    """Return K of both springs on a mesh of a scale [N/mm], shape (2,)."""
    return np.array(solved(case, scale).K)
