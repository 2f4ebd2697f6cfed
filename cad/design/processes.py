"""Print processes and their materials, read from processes.toml, where every number has its own source."""

from dataclasses import dataclass
from pathlib import Path

from cad.quantity import Bounds, check_fields, check_sources, quantity, sourced_records

_POSITIVE = Bounds(above=0.0)
_SHARE = Bounds(above=0.0, below=1.0)
_DATA = "correct the entry in cad/design/processes.toml"


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
        check_sources(self, f"process {self.name}", _DATA)

    @property
    def leaf_thicknesses_mm(self) -> tuple[float, float]:
        """Return the thickness of the leaves by spring, the low one's first [mm]."""
        return self.leaf_thickness_low_mm, self.leaf_thickness_high_mm


PROCESSES = sourced_records(Path(__file__).with_name("processes.toml"), Process, "process", _DATA)
