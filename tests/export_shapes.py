"""One clean curve in the shapes that testing machines, loggers and spreadsheets export.

export_shapes.json has labels of its columns in many languages, spellings and units, and whole files of other shapes.
"""

import json
from base64 import b64decode
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

TRAVEL = np.round(np.arange(26) * 0.12, 2)  # [mm]
DEPTH = np.clip(TRAVEL - 0.35, 0.0, None) / 2.0  # [mm] on each side of a ball between plates
FORCE = np.round(4.0 / 3.0 / (1.0 - 0.3**2) * np.sqrt(35.0) * DEPTH**1.5, 4)  # [N], Hertz: 1 MPa, a radius of 35 mm
TIME = np.round(2.0 * TRAVEL, 2)  # [s]
STORED: dict[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
"""`languages` have an encoding of theirs before Unicode, `units` what one is worth in N, mm or s."""
EXTRAS: list[str] = STORED["extras"]


class Shape(NamedTuple):
    """A file with the flags that it needs."""

    content: bytes
    columns: str | None = None
    units: str | None = None
    suffix: str = "csv"


def table(
    labels: Sequence[str],
    columns: Sequence[Sequence[object]],
    delimiter: str = ",",
    cell: Callable[[object], str] = str,
) -> str:
    """Return a header and its rows."""
    rows = [map(cell, row) for row in zip(*columns, strict=True)]
    return "".join(delimiter.join(row) + "\n" for row in [labels, *rows])


def two(force: str = "force_N", travel: str = "travel_mm", F: float = 1.0, x: float = 1.0, **how: Any) -> str:
    """Return the curve under two labels, each number divided by what its unit is worth."""
    columns = [[repr(float(f"{value / of:.9g}")) for value in values] for values, of in ((FORCE, F), (TRAVEL, x))]
    return table([force, travel], columns, **how)


def comma(value: object) -> str:
    """Return a number with a decimal comma."""
    return str(value).replace(".", ",")


def labels() -> Iterator[tuple[str, Shape]]:
    """Yield the curve under labels of all languages, spellings and units, and beside other columns."""
    for name, (encoding, *of_columns) in STORED["languages"].items():
        columns = [TIME, TRAVEL, FORCE]
        yield name, Shape(table(of_columns, columns).encode())
        yield f"{name} before Unicode", Shape(table(of_columns, columns, "\t").encode(encoding))
    for force, travel in STORED["headers"]:
        chosen = None if travel[0] != "d" and force[:4] != "Pene" else f"force={force},travel={travel}"
        yield f"header {force}, {travel}", Shape(two(force, travel, delimiter="\t").encode(), chosen)
    units = STORED["units"]
    for unit, worth in units["force"].items():
        yield f"force in {unit}", Shape(two(f"Load [{unit}]", F=worth).encode())
    for unit, worth in units["travel"].items():
        yield f"travel in {unit}", Shape(two(travel=f"Travel ({unit})", x=worth).encode())
    for unit, worth in units["time"].items():
        text = table([f"Time ({unit})", "F (N)", "x (mm)"], [TIME / worth, FORCE, TRAVEL])
        yield f"time in {unit}", Shape(text.encode())
    for label in EXTRAS:
        yield f"beside {label}", Shape(table(["force_N", "travel_mm", label], [FORCE, TRAVEL, [1] * 26]).encode())


def whole_file(stored: dict[str, str]) -> Shape:
    """Return a stored file: the bytes of a workbook, or a text in its encoding."""
    if "workbook" in stored:
        content = b64decode(stored["workbook"])
    else:
        content = stored["text"].encode(stored.get("encoding", "utf-8"))
    return Shape(content, stored.get("columns"), stored.get("units"), stored.get("suffix", "csv"))


SHAPES = {**{name: whole_file(stored) for name, stored in STORED["files"].items()}, **dict(labels())}
"""Every shape by its name."""
