"""The ten mangoes that the paper compressed, its Table I, read from mango_tests.toml."""

import tomllib
from pathlib import Path
from typing import NamedTuple

_DATA = tomllib.loads(Path(__file__).with_name("mango_tests.toml").read_text(encoding="utf-8"))


class CompressedMango(NamedTuple):
    """One mango of a compression test: its number, its variety, its modulus E and the scatter of E [MPa]."""

    number: int
    variety: str
    E_MPa: float
    scatter_MPa: float


MANGOES = tuple(CompressedMango(**row) for row in _DATA["mango"])
"""In the order of the table."""
