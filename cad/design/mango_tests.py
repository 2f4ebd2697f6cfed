"""The ten mangoes that the paper compressed, its Table I, read from mango_tests.toml."""

import tomllib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class CompressedMango:
    """One mango of a compression test: its number, its variety, its modulus E and the scatter of E [MPa]."""

    number: int
    variety: str
    E_MPa: float
    scatter_MPa: float

    def __post_init__(self) -> None:
        """Refuse a modulus or a scatter that is not positive."""
        if not (self.E_MPa > 0.0 and self.scatter_MPa > 0.0):
            msg = f"mango {self.number}: E and its scatter must be greater than 0 MPa; correct mango_tests.toml"
            raise ValueError(msg)


@dataclass(frozen=True, kw_only=True)
class MangoTests:
    """A table of compression tests: where it is printed, and its mangoes in the order of the table."""

    source: str
    isbn: str
    mangoes: tuple[CompressedMango, ...]


def read_mango_tests(path: Path) -> MangoTests:
    """Return the tests of a file [MPa]; raises OSError, ValueError or TypeError where it is not a table of them."""
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    mangoes = tuple(CompressedMango(**row) for row in data["mango"])
    return MangoTests(source=data["source"], isbn=data["isbn"], mangoes=mangoes)


MANGO_TESTS = read_mango_tests(Path(__file__).with_name("mango_tests.toml"))
