"""The reference values for the error bars, by their names in bars.toml."""

import tomllib
from pathlib import Path

from benchmarks.harness import Reference

BARS = tomllib.loads(Path(__file__).with_name("bars.toml").read_text(encoding="utf-8"))
TRUTHS = {
    name: Reference(values=tuple(truth["values"]), errors=tuple(truth["errors"]), source=truth["source"])
    for name, truth in BARS["truth"].items()
}
