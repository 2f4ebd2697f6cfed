"""Print processes and their materials as data, each number with its source.

Sources: [maker] moduli and limits of desktop and service prints as published by machine and material makers
(typical data-sheet values: PETG 2.0 GPa, PLA 3.3 GPa, PA12 1.65 to 1.9 GPa, SLA resin 2.5 GPa, 17-4PH 190 to
197 GPa, Ti64 110 GPa, spring steel 200 to 210 GPa); [guide] design guides of print services for minimum wall,
gap and accuracy. They set the first print; each printed unit is calibrated before its numbers are trusted.
"""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Process:
    """A way to make the housing: material, limits of the machine, and the leaf thicknesses that suit it."""

    name: str
    material: str
    E_MPa: float
    poisson: float
    strain_limit: float  # largest cyclic strain [1]
    density_g_per_cm3: float
    min_wall_mm: float
    min_gap_mm: float
    fillet_mm: float
    accuracy_mm: float  # plus or minus, on a thin wall
    leaf_thickness_low_mm: float
    leaf_thickness_high_mm: float
    depth_mm: float
    source: str


_MAKER = "maker's data sheet, typical; walls and gaps from print-service design guides"

_ALL = (
    Process(
        name="fdm-petg", material="PETG", E_MPa=2000.0, poisson=0.38, strain_limit=0.010, density_g_per_cm3=1.27,
        min_wall_mm=0.8, min_gap_mm=0.3, fillet_mm=0.5, accuracy_mm=0.05,
        leaf_thickness_low_mm=0.8, leaf_thickness_high_mm=1.2, depth_mm=6.0, source=_MAKER,
    ),
    Process(
        name="fdm-pla", material="PLA", E_MPa=3300.0, poisson=0.36, strain_limit=0.008, density_g_per_cm3=1.24,
        min_wall_mm=0.8, min_gap_mm=0.3, fillet_mm=0.5, accuracy_mm=0.05,
        leaf_thickness_low_mm=0.8, leaf_thickness_high_mm=1.2, depth_mm=6.0, source=_MAKER,
    ),
    Process(
        name="sls-pa12", material="PA12", E_MPa=1650.0, poisson=0.39, strain_limit=0.012, density_g_per_cm3=0.95,
        min_wall_mm=0.8, min_gap_mm=0.5, fillet_mm=0.5, accuracy_mm=0.1,
        leaf_thickness_low_mm=0.8, leaf_thickness_high_mm=1.2, depth_mm=6.0, source=_MAKER,
    ),
    Process(
        name="sla-resin", material="SLA resin", E_MPa=2500.0, poisson=0.38, strain_limit=0.008, density_g_per_cm3=1.15,
        min_wall_mm=0.5, min_gap_mm=0.3, fillet_mm=0.5, accuracy_mm=0.05,
        leaf_thickness_low_mm=0.7, leaf_thickness_high_mm=1.0, depth_mm=6.0, source=_MAKER,
    ),
    Process(
        name="dmls-17-4ph", material="17-4PH steel", E_MPa=193000.0, poisson=0.29, strain_limit=0.0025,
        density_g_per_cm3=7.8, min_wall_mm=0.4, min_gap_mm=0.5, fillet_mm=0.5, accuracy_mm=0.05,
        leaf_thickness_low_mm=0.4, leaf_thickness_high_mm=0.5, depth_mm=6.0, source=_MAKER,
    ),
    Process(
        name="dmls-ti64", material="Ti-6Al-4V", E_MPa=110000.0, poisson=0.34, strain_limit=0.004,
        density_g_per_cm3=4.43, min_wall_mm=0.4, min_gap_mm=0.5, fillet_mm=0.5, accuracy_mm=0.05,
        leaf_thickness_low_mm=0.4, leaf_thickness_high_mm=0.5, depth_mm=6.0, source=_MAKER,
    ),
    Process(
        name="strip-steel", material="spring steel strip", E_MPa=206000.0, poisson=0.29, strain_limit=0.003,
        density_g_per_cm3=7.85, min_wall_mm=0.1, min_gap_mm=0.3, fillet_mm=0.5, accuracy_mm=0.01,
        leaf_thickness_low_mm=0.3, leaf_thickness_high_mm=0.5, depth_mm=6.0, source=_MAKER,
    ),
)

PROCESSES: dict[str, Process] = {process.name: process for process in _ALL}
