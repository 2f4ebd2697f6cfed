"""Print processes and their materials as data: every number with its own source, and what of it was not verified.

Sources that begin with "typical" are values in common use that were not checked against a data sheet; all others
were read where they say. They set the first print: each printed unit is calibrated before its numbers are trusted.
"""

import dataclasses
from dataclasses import dataclass

from cad.quantity import Bounds, check_fields, fault, quantity

_POSITIVE = Bounds(above=0.0)
_SHARE = Bounds(above=0.0, below=1.0)
_DATA = "correct the entry in cad/materials.py"


@dataclass(frozen=True, kw_only=True)
class Process:
    """A way to make the housing: material, limits of the machine, and the leaves that suit it.

    `E_scatter` is one sigma of E from print to print as a fraction of E; `strain_limit` holds for cyclic bending;
    `accuracy_mm` is plus or minus two sigma of the thickness of a thin wall; `overhang_deg` is the largest slope from
    the vertical that needs no support; `line_width_mm` and `layer_mm` are None where the process has none. Not in
    `one_piece`, the leaves are clamped in a body of another material.
    """

    name: str
    material: str
    E_MPa: float = quantity("MPa", _POSITIVE, remedy=_DATA)
    E_scatter: float = quantity("1", _SHARE, remedy=_DATA)
    poisson: float = quantity("1", Bounds(above=-1.0, below=0.5), remedy=_DATA)
    strain_limit: float = quantity("1", _SHARE, remedy=_DATA)
    density_g_per_cm3: float = quantity("g/cm3", _POSITIVE, remedy=_DATA)
    min_wall_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    min_gap_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    fillet_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    overhang_deg: float = quantity("deg", Bounds(above=0.0, at_most=90.0), remedy=_DATA)
    accuracy_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    line_width_mm: float | None = quantity("mm", _POSITIVE, default=None, remedy=_DATA)
    layer_mm: float | None = quantity("mm", _POSITIVE, default=None, remedy=_DATA)
    leaf_thickness_low_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    leaf_thickness_high_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    depth_mm: float = quantity("mm", _POSITIVE, remedy=_DATA)
    one_piece: bool = True
    sources: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        """Check each number, and that each number that is given has a source."""
        check_fields(self, f"process {self.name}")
        given = {item.name for item in _numbers() if getattr(self, item.name) is not None}
        told = {field for field, _ in self.sources}
        for field in sorted(given ^ told):
            name, value = f"process {self.name}.{field}", getattr(self, field, None)
            raise fault(name, value, "", "a number with one source", _DATA)

    def source_of(self, field: str) -> str:
        """Return where a number comes from; raises KeyError for a field without one."""
        return dict(self.sources)[field]


def _numbers() -> list[dataclasses.Field[object]]:
    return [item for item in dataclasses.fields(Process) if "unit" in item.metadata]


def _sources(*shares: dict[str, str]) -> tuple[tuple[str, str], ...]:
    """Join sources; a later share replaces what an earlier one says of the same field."""
    return tuple({field: source for share in shares for field, source in share.items()}.items())


_THIRD = "0.3 x tensile strength / E, a rule for cyclic bending, not a fatigue test; strength: "
_SIDEWAYS = "design rule: sideways stiffness at least 3 x (low) and 1.2 x (high) the travel stiffness, checked by FE"
_ARTI90 = "arti90.com design clues"

_FDM = {
    "E_scatter": "filament-db wiki, FDM appendices: brands and batches vary by 10 to 25 %, taken as two sigma of 20 %",
    "min_wall_mm": "3dservicesusa.com and printit4me.com.au design guides: two lines of a 0.4 mm nozzle",
    "min_gap_mm": "printit4me.com.au design guide, snap fit 0.3; arti90.com says 0.2",
    "fillet_mm": "additive.tools on PA12, least radius 0.5 of an inner corner, taken for all",
    "overhang_deg": _ARTI90,
    "accuracy_mm": "typical of a wall of two or three lines; guides give 0.2 mm for a whole part",
    "line_width_mm": "PrusaSlicer 2.5 with a 0.4 mm nozzle; thin walls of whole lines",
    "layer_mm": "bicester3d.co.uk design guide, standard layer",
    "leaf_thickness_low_mm": "two lines of 0.4 mm",
    "leaf_thickness_high_mm": "three lines of 0.4 mm",
    "depth_mm": _SIDEWAYS,
}
_DMLS = {
    "E_scatter": "typical of one alloy over machines and build directions",
    "min_wall_mm": f"{_ARTI90}, wall held on two sides; cifproto.com says 0.5",
    "min_gap_mm": f"{_ARTI90}, moving parts",
    "fillet_mm": "additive.tools on PA12, least radius 0.5 of an inner corner, taken for all",
    "overhang_deg": _ARTI90,
    "accuracy_mm": f"typical of a thin wall; {_ARTI90} gives 0.1 for a part",
    "leaf_thickness_low_mm": "a quarter above the least wall, so that a wall printed thin is still a wall",
    "leaf_thickness_high_mm": "twice the least wall: a long leaf whose thickness scatters by 6 %, not 10",
    "depth_mm": _SIDEWAYS,
}

_ALL = (
    Process(
        name="fdm-petg", material="PETG", E_MPa=2000.0, E_scatter=0.10, poisson=0.38, strain_limit=0.0066,
        density_g_per_cm3=1.27, min_wall_mm=0.8, min_gap_mm=0.3, fillet_mm=0.5, overhang_deg=45.0, accuracy_mm=0.05,
        line_width_mm=0.4, layer_mm=0.2, leaf_thickness_low_mm=0.8, leaf_thickness_high_mm=1.2, depth_mm=10.0,
        sources=_sources(_FDM, {
            "E_MPa": "designerdata.nl PETG, around 2000 MPa; additive.tools, printed flat, 2 to 3 GPa",
            "poisson": "typical of PETG",
            "strain_limit": _THIRD + "additive.tools PETG, printed flat, 44 to 56 MPa",
            "density_g_per_cm3": "additive.tools PETG, 1.25 to 1.29",
        }),
    ),
    Process(
        name="fdm-pla", material="PLA", E_MPa=3300.0, E_scatter=0.10, poisson=0.36, strain_limit=0.0045,
        density_g_per_cm3=1.24, min_wall_mm=0.8, min_gap_mm=0.3, fillet_mm=0.5, overhang_deg=45.0, accuracy_mm=0.05,
        line_width_mm=0.4, layer_mm=0.2, leaf_thickness_low_mm=0.8, leaf_thickness_high_mm=1.2, depth_mm=10.0,
        sources=_sources(_FDM, {
            "E_MPa": "additive.tools PLA, printed flat, 3 to 4 GPa",
            "poisson": "typical of PLA",
            "strain_limit": _THIRD + "additive.tools PLA, printed flat, 50 to 65 MPa",
            "density_g_per_cm3": "additive.tools PLA, 1.22 to 1.26",
        }),
    ),
    Process(
        name="sls-pa12", material="PA12", E_MPa=1650.0, E_scatter=0.10, poisson=0.39, strain_limit=0.008,
        density_g_per_cm3=0.93, min_wall_mm=0.8, min_gap_mm=0.5, fillet_mm=0.5, overhang_deg=90.0, accuracy_mm=0.1,
        layer_mm=0.1, leaf_thickness_low_mm=0.8, leaf_thickness_high_mm=1.2, depth_mm=10.0,
        sources=_sources({
            "E_MPa": "typical of laser-sintered PA12, data sheets 1650 to 1900 MPa",
            "E_scatter": "typical; additive.tools PA12: walls below 1.5 mm scatter more than the bulk",
            "poisson": "typical of PA12",
            "strain_limit": _THIRD + "additive.tools PA12, laser sintered, 44 to 52 MPa",
            "density_g_per_cm3": "additive.tools PA12",
            "min_wall_mm": "additive.tools PA12 and cifproto.com",
            "min_gap_mm": f"{_ARTI90}, moving parts",
            "fillet_mm": "additive.tools PA12, least radius of an inner corner",
            "overhang_deg": "printit4me.com.au design guide: the powder carries every overhang",
            "accuracy_mm": "typical of a thin wall; guides give 0.2 to 0.3 mm for a part",
            "layer_mm": "typical of laser sintering, 0.1 mm",
            "leaf_thickness_low_mm": "the least wall",
            "leaf_thickness_high_mm": "one and a half times the low leaf, as for FDM, so one drawing serves both",
            "depth_mm": _SIDEWAYS,
        }),
    ),
    Process(
        name="sla-resin", material="SLA resin", E_MPa=2500.0, E_scatter=0.10, poisson=0.38, strain_limit=0.006,
        density_g_per_cm3=1.15, min_wall_mm=0.5, min_gap_mm=0.3, fillet_mm=0.5, overhang_deg=45.0, accuracy_mm=0.05,
        layer_mm=0.05, leaf_thickness_low_mm=0.7, leaf_thickness_high_mm=1.0, depth_mm=10.0,
        sources=_sources({
            "E_MPa": "typical of a standard resin after curing, 2.2 to 2.9 GPa",
            "E_scatter": "typical; the cure moves E more than the print does",
            "poisson": "typical of a glassy resin",
            "strain_limit": _THIRD + "typical of a standard resin after curing, 50 MPa",
            "density_g_per_cm3": "typical of a cured resin, 1.1 to 1.2",
            "min_wall_mm": "cifproto.com, standard resin",
            "min_gap_mm": "hycubeworks.in design guide, loose clearance",
            "fillet_mm": "additive.tools on PA12, least radius 0.5 of an inner corner, taken for all",
            "overhang_deg": "typical; guides ask for supports under every island",
            "accuracy_mm": "VT DISCO Lab wiki, Form 4: 0.15 % and at least 0.02 mm, more than doubled for the cure",
            "layer_mm": "VT DISCO Lab wiki, Form 4: 0.025 to 0.3 mm",
            "leaf_thickness_low_mm": "1.4 times the least wall",
            "leaf_thickness_high_mm": "twice the least wall",
            "depth_mm": _SIDEWAYS,
        }),
    ),
    Process(
        name="dmls-17-4ph", material="17-4PH steel", E_MPa=193000.0, E_scatter=0.03, poisson=0.29,
        strain_limit=0.0014, density_g_per_cm3=7.8, min_wall_mm=0.4, min_gap_mm=0.5, fillet_mm=0.5, overhang_deg=45.0,
        accuracy_mm=0.05, layer_mm=0.04, leaf_thickness_low_mm=0.5, leaf_thickness_high_mm=0.8, depth_mm=6.0,
        sources=_sources(_DMLS, {
            "E_MPa": "typical of 17-4PH, 190 to 197 GPa",
            "poisson": "typical of 17-4PH, 0.27 to 0.29",
            "strain_limit": _THIRD + "typical of 17-4PH as built, 900 MPa",
            "density_g_per_cm3": "typical of 17-4PH",
            "layer_mm": "typical of powder-bed steel, 0.04 mm",
        }),
    ),
    Process(
        name="dmls-ti64", material="Ti-6Al-4V", E_MPa=110000.0, E_scatter=0.03, poisson=0.34, strain_limit=0.0023,
        density_g_per_cm3=4.43, min_wall_mm=0.4, min_gap_mm=0.5, fillet_mm=0.5, overhang_deg=45.0, accuracy_mm=0.05,
        layer_mm=0.04, leaf_thickness_low_mm=0.5, leaf_thickness_high_mm=0.8, depth_mm=6.0,
        sources=_sources(_DMLS, {
            "E_MPa": "typical of Ti-6Al-4V, 110 to 114 GPa",
            "poisson": "typical of Ti-6Al-4V, 0.31 to 0.34",
            "strain_limit": _THIRD + "AMS 4999A, 855 MPa, as quoted in Sci. Rep. 9 (2019), s41598-019-45696-w",
            "density_g_per_cm3": "typical of Ti-6Al-4V",
            "layer_mm": "EOS Titanium Ti64 Grade 5 material page, M 290, 40 micrometre",
        }),
    ),
    Process(
        name="strip-steel", material="spring steel strip", E_MPa=206000.0, E_scatter=0.01, poisson=0.29,
        strain_limit=0.0021, density_g_per_cm3=7.85, min_wall_mm=0.1, min_gap_mm=0.3, fillet_mm=0.5,
        overhang_deg=45.0, accuracy_mm=0.02, leaf_thickness_low_mm=0.3, leaf_thickness_high_mm=0.5, depth_mm=12.7,
        one_piece=False,
        sources=_sources({
            "E_MPa": "typical of carbon steel, 205 to 206 GPa",
            "E_scatter": "typical of rolled strip",
            "poisson": "typical of carbon steel",
            "strain_limit": _THIRD + "typical of hardened strip, 1500 MPa",
            "density_g_per_cm3": "typical of carbon steel",
            "min_wall_mm": "typical, thinnest strip that is handled without care",
            "min_gap_mm": "that of the printed body, as fdm-petg",
            "fillet_mm": "that of the printed body; a clamped strip itself has none",
            "overhang_deg": f"{_ARTI90}, that of the printed body",
            "accuracy_mm": "precisionsteel.com tolerance data, 0.009 to 0.020 inch: plus or minus 0.00075 inch",
            "leaf_thickness_low_mm": "typical stock of strip and feeler gauge",
            "leaf_thickness_high_mm": "typical stock of strip and feeler gauge",
            "depth_mm": "typical width of feeler strip, half an inch, used as sold; " + _SIDEWAYS,
        }),
    ),
)  # fmt: skip

PROCESSES: dict[str, Process] = {process.name: process for process in _ALL}
