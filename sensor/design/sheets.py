"""Sheet that leaves are cut from, read from sheets.toml; every number has a source."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from sensor.input_file import read_toml
from sensor.quantity import LENGTH, MODULUS, Bounds, Sourced, quantity, text_field, validation_error

_FRACTION = Bounds(above=0.0, below=1.0)
_STOCK = Bounds(above=0.0)


@dataclass(frozen=True, kw_only=True)
class SoldSheet(Sourced):
    """A sheet as it is sold: its material, and the thicknesses on the shelf with their tolerances.

    `E_scatter` is one sigma of E as a fraction of E; `strain_limit` holds for bending again and again. `tolerances_mm`,
    `weighed`, the fraction to which weighing tells a thickness, and `width_mm`, that of a cut, are two sigma. Pieces on
    the shelf are as wide and long as `stock_widths_mm` and `stock_lengths_mm`, tape first.
    """

    LABEL: ClassVar[str] = "sheet"

    material: str = text_field()
    E_MPa: float = quantity("MPa", MODULUS)
    E_scatter: float = quantity("1", _FRACTION)
    E_per_K: float = quantity("1/K", Bounds(at_least=-0.1, at_most=0.1))
    poisson: float = quantity("1", Bounds(above=-1.0, below=0.5))
    strain_limit: float = quantity("1", _FRACTION)
    density_g_per_cm3: float = quantity("g/cm3", Bounds(above=0.0, at_most=30.0))
    thicknesses_mm: tuple[float, ...] = quantity("mm", LENGTH)
    tolerances_mm: tuple[float, ...] = quantity("mm", LENGTH)
    weighed: float = quantity("1", _FRACTION)
    width_mm: float = quantity("mm", LENGTH)
    stock_widths_mm: tuple[float, ...] = quantity("mm", _STOCK)
    stock_lengths_mm: tuple[float, ...] = quantity("mm", _STOCK)

    def __post_init__(self) -> None:
        """Check each number, that it has a source, and that each thickness has its tolerance."""
        super().__post_init__()
        if len(self.tolerances_mm) != len(self.thicknesses_mm):
            bound = f"a list of {len(self.thicknesses_mm)} numbers, one for each thickness"
            name = f"sheet {self.name}.tolerances_mm"
            raise validation_error(name, list(self.tolerances_mm), "mm", bound, self.HINT)

    @property
    def stock(self) -> tuple[tuple[float, float], ...]:
        """Return width and length of each piece on the shelf [mm]."""
        return tuple(zip(self.stock_widths_mm, self.stock_lengths_mm, strict=True))

    def sold_as(self, thickness: float) -> float:
        """Return the listed thickness that is nearest to another one [mm]."""
        return min(self.thicknesses_mm, key=lambda each: abs(each - thickness))

    def tolerance(self, thickness: float) -> float:
        """Return how far a sheet of a listed thickness [mm] may be off [mm]."""
        return self.tolerances_mm[self.thicknesses_mm.index(thickness)]

    def check_listed(self, name: str, thickness: float) -> None:
        """Raise InputError, which names the nearest one, for a thickness [mm] that no dealer lists."""
        if thickness not in self.thicknesses_mm:
            listed = ", ".join(f"{each:g}" for each in self.thicknesses_mm)
            bound = f"a sheet that dealers list: {listed} mm"
            raise validation_error(name, thickness, "mm", bound, f"take the nearest, {self.sold_as(thickness):g} mm")

    def check_measured(self, name: str, measured: float, thickness: float) -> None:
        """Raise InputError for a measured thickness that a sheet of a listed one [mm] cannot have."""
        off = self.tolerance(thickness)
        if abs(measured - thickness) > 2.0 * off:
            bound = f"within {2.0 * off:g} mm of the sheet of {thickness:g} mm, twice its tolerance"
            raise validation_error(name, measured, "mm", bound, "weigh the sheet again, or name the sheet that it is")


SHEETS = SoldSheet.from_tables(read_toml(Path(__file__).with_name("sheets.toml"), "sheets"))
