"""Write design-file.md, words.md and the tables of keys in other pages from the program's own data.

`python docs/pages.py` writes them. The meaning of a key stands beside its field.
"""

import dataclasses
import re
import sys
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))


from instrument.compress.modulus import CompressionResult  # noqa: E402
from instrument.press.fruit_reading import FruitReading  # noqa: E402
from pipeline.report.explain.entries import entries  # noqa: E402
from pipeline.report.keys import report_keys  # noqa: E402
from sensor.design.design_file import TABLE_TYPES  # noqa: E402
from sensor.design.processes import PROCESSES, Process  # noqa: E402
from sensor.design.tip_mount import pad_height  # noqa: E402
from solve.contact.scene import STEEPEST_DEG  # noqa: E402

DESIGN_HEAD = """\
# The design file: what you can choose

*Written by `docs/pages.py` from the program's own parameters.*

A design file is TOML text. It holds every number that you can choose. A key that you leave out has its default value;
the defaults are the sensor of the paper. The name of a key ends with its unit; a key without a unit is a plain number.
A run refuses an unknown key, and the message names the most similar known key. It also refuses a key of older versions,
and the message says what to write instead.

    name = "mine"

    [targets]
    NL = 0.03

    [fruit]
    height_mm = 20.0

Run this design with `pipeline run --design mine.toml`. A flag can replace a key of the file:
`pipeline run --set fruit.height_mm=20`. The [presets](presets.md) are design files too, in [designs](../designs), with
the source of each number; `--design mango` uses the preset `mango`. Every output folder has a `design.toml` with which
you can repeat the run. [Words](words.md#words-and-symbols) explains the terms of this page.

The key `name` is a text of 1 to 64 letters, digits, `-` or `_`. The output folder has this name, and it is engraved in
the part. A design without `name` takes the name of its file.
"""

DESIGN_TAIL = """\
## What several keys decide together

**The fruit**

- A block has no radii. A sphere needs `radius_mm`; an ellipsoid needs `radius_mm` and `radius_across_mm`.
- A piece of a curved fruit, given by `length_mm` and `width_mm`, must be so small that its corners lie above its base.
- `press.travel_mm` must be less than `fruit.height_mm`, or than `fruit.thickness_mm` if that is given.

**The tips**

- All tips must lie on the fruit and must not overlap: `tips.spacing_mm` is greater than `tips.side_mm`.
- `tips.fillet_mm` must be less than half of `tips.side_mm`; a sphere has no fillet.
- The angle between a tip face and the skin must be at most {steepest:g} degrees; a run refuses a steeper scene.
- The contact of a dome must lie within half of its face; else the verdict `geometry.tip_face` fails.
- Printed tips are sharp squares, or domes on squares. Another shape or a fillet needs `tips.socket = "pin"`, because
  a pin can be ground to any shape.
- A pair lies along the length of the fruit, with the low tip at -x and the high tip at +x. A line lies in the same
  direction, in the order of `tips.order`. The tips of a square are counted around it from (-x, -y): low, high, low,
  high.

**The springs**

- `[springs]` must give both stiffnesses or none, and the low one must be less than the high one.
- Lines and squares need `[springs]`, because targets size a pair only.
- With `[springs]` and without `[targets]`, the report has P_max and NL, but no verdicts on them.
- With tilt, roll, curved fruit, fillets or spheres, a tip may touch with part of its face or lift off. The springs are
  then sized for a flat block of the same size under sharp flat tips. Forces and P are still computed for the actual
  fruit, tips and press.
- A square is printed as two equal plates back to back. `tips.spacing_mm` is the depth of one plate plus the height of
  the pads between the plates, {pads} mm. It must leave a plate that is at least as deep as a tip is wide.
- A line of three, such as [fouly.toml](examples/fouly.toml), has no housing, so `pipeline design` refuses it.
  `pipeline run` judges its readings, or without `[reading]` its force ratio, see [layouts](presets.md#layouts-of-tips).
  `press.attitude`, `print.max_length_mm`, `print.E_MPa` and `print.mount` must keep their defaults then.

**Reading and read-out**

- With `[reading]`, the verdicts judge the error of the modulus that the sensor reads, in place of P.
- A key that another one replaces must keep its default: `press.tilt_spread_deg` with `[reading]`,
  `reading.radius_spread` with `reading.radius_mm` or on a block, and `fruit.height_mm` with `fruit.thickness_mm`.
  `fruit.skin_poisson` needs a skin.
- With `[readout]`, a run computes the noise of the forces from the data of the read-out; leave out
  `reading.noise_percent` and `noise_N` then.
- With `[readout]`, a print process of your own must give `E_per_K`, because the drift of the forces depends on it.

**The leaves**

- `print.leaf_thickness_low_mm` and `leaf_thickness_high_mm` are whole numbers of lines where the process prints lines.
- A leaf must be so thick that the process knows its thickness, and the verdicts `printable.*` compare it with the
  thinnest wall.
"""

PROCESS_HEAD = """\
## Print processes

`pipeline design --list-processes` prints the same table. Each process can make the default design; [springs of each
process](measurements.md#springs-of-each-process) has the errors of both springs.

In the filament processes, the thickness of a leaf is a multiple of the width of a printed line. A leaf of the low
spring has {low_lines:g} lines of {line:g} mm, a leaf of the high spring {high_lines:g}. A design may
give [other thicknesses](#print). The picture shows the first layer and a middle layer in the slicer:

![the paths of the nozzle in the first and in a middle layer of the housing](slices.png)

A source that begins with "typical" marks a value in common use that nobody checked against a data sheet. All other
numbers were read at the named source. The numbers are good enough for the first print only: calibrate each printed unit
before you trust its readings.
"""

PROCESS_TAIL = """\
### A printer of your own

Copy the table of the nearest process from `sensor/design/processes.toml` into a file of your own. Give it a new name,
and change what you have measured. Every number needs its source. A number out of bounds or an unknown key is refused in
one line. If `creep_per_decade` and `creep_scatter` are missing, the springs count as elastic. The key `kind` is fdm,
sla, sls, dmls or other; it chooses what the fabrication sheet says about supports, washing, heat and powder. Give the
path of the file in the design, relative to the design file:

    [print]
    process_file = "my-printer.toml"

If the file has several processes, add `process = "NAME"` to the same table. A run copies the process with its sources
into the table `printer` of `design.toml` and of `report.json`, so the output folder needs no other file.
`pipeline design --list-processes` also shows this process if you name the design.
"""

WORDS_HEAD = """\
# What verdicts, words and symbols mean

*Written by `docs/pages.py`.* `pipeline explain NAME` says more about each name, with its formula and its source. Add
`--out DIR` to see its value in that run. Units are mm, N and MPa; a key or a label that uses another unit says so.
"""

Rows = Iterable[Sequence[str]]


def table(heads: Sequence[str], rows: Rows) -> str:
    """Return a Markdown table."""
    lines = (heads, ["---"] * len(heads), *rows)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def design_tables() -> dict[str, list[dataclasses.Field[Any]]]:
    """Return the fields of each table of the design file by the table's name."""
    return {name: list(dataclasses.fields(kind)) for name, kind in TABLE_TYPES.items()}


def design_row(item: dataclasses.Field[Any]) -> tuple[str, ...]:
    """Return one key of the design file: its name, which carries its unit, bounds, default and meaning."""
    data = item.metadata
    choices = ", ".join(data.get("options", ()))
    bounds = f"one of {choices}" if choices else str(data.get("bounds") or data["text"])
    return f"`{item.name}`", bounds, shown(item.default), data["meaning"]


def shown(value: object) -> str:
    """Return a default as it would stand in the file; none for a key that may be left out."""
    if value is None:
        return "not set"
    if isinstance(value, tuple):
        return f"[{', '.join(map(str, value))}]"
    return f'"{value}"' if isinstance(value, str) else str(value)


def design_page() -> str:
    """Return the page on the design file."""
    tables = design_tables()
    heads = ("key", "bounds", "default", "meaning")
    parts = [DESIGN_HEAD]
    for name, items in tables.items():
        rows = [design_row(item) for item in items]
        parts += [f"## [{name}]\n", table(heads, rows) + "\n"]
    return "\n".join([*parts, together(), process_section()])


def together() -> str:
    """Return the section on keys that decide something together, with the numbers of the code."""
    return DESIGN_TAIL.format(
        steepest=STEEPEST_DEG,
        pads=or_list(sorted({2.0 * pad_height(process) for process in PROCESSES.values()})),
    )


def or_list(numbers: Sequence[float]) -> str:
    """Return numbers as a list in words, the last two joined by "or"."""
    *first, last = (f"{number:g}" for number in numbers)
    return f"{', '.join(first)} or {last}"


def process_section() -> str:
    """Return the section on the print processes."""
    numbers = {item.name: item.metadata for item in dataclasses.fields(Process) if "unit" in item.metadata}
    heads = ("", *PROCESSES, "meaning")
    rows: list[tuple[str, ...]] = [("material", *(process.material for process in PROCESSES.values()), "")]
    for key, declared in numbers.items():
        values = (getattr(process, key) for process in PROCESSES.values())
        cells = ("-" if value is None else f"{value:g}" for value in values)
        rows.append((f"`{key}`", *cells, declared["meaning"]))
    sources = [(f"`{key}`", sources_of(key)) for key in numbers]
    petg = PROCESSES["fdm-petg"]
    line = petg.line_width_mm
    lines = [leaf / line for leaf in (petg.leaf_thickness_low_mm, petg.leaf_thickness_high_mm)]
    head = PROCESS_HEAD.format(line=line, low_lines=lines[0], high_lines=lines[1])
    parts = [head, table(heads, rows) + "\n", "### Where each number comes from\n"]
    return "\n".join([*parts, table(("number", "source"), sources) + "\n", PROCESS_TAIL])


def sources_of(key: str) -> str:
    """Return the sources of a number, each once with the processes that it serves."""
    users: dict[str, list[str]] = {}
    for name, process in PROCESSES.items():
        source = dict(process.sources).get(key)
        if source is not None:
            users.setdefault(source, []).append(name)
    if len(users) == 1:
        return next(iter(users))
    return " · ".join(f"{', '.join(names)}: {source}" for source, names in users.items())


def words_page() -> str:
    """Return the page on verdicts, words and symbols."""
    parts = [WORDS_HEAD]
    for title, is_verdict in (("Verdicts", True), ("Words and symbols", False)):
        rows = []
        for entry in entries():
            if entry.is_verdict is is_verdict:
                names = ", ".join(f"`{name}`" for name in entry.each or (entry.name, *entry.aliases))
                formula = (entry.formula.replace("|", "\\|"),) if is_verdict else ()
                rows.append((names, first_sentence(entry.meaning), *formula))
        heads = ("name", "question", "passes when") if is_verdict else ("name", "meaning")
        parts.append(f"## {title}\n\n{table(heads, rows)}\n")
    return "\n".join(parts)


_KEYS = re.compile(r"(<!-- keys: (.+) -->\n)(?:\|.*\n)*")


def report_page() -> str:
    """Return the page on report.json with its tables, each behind a comment that names its first keys."""
    return _KEYS.sub(key_table, (DOCS / "report-json.md").read_text(encoding="utf-8"))


def key_table(found: re.Match[str]) -> str:
    """Return the comment of a table with the keys of report.json below those that it names."""
    named = found[2].split()
    keys = [key for key in report_keys() if re.split(r"[.\[]", key.name)[0] in named]
    keys.sort(key=lambda key: named.index(re.split(r"[.\[]", key.name)[0]))
    rows = [(f"`{key.name}`", key.unit, key.meaning) for key in keys]
    return f"{found[1]}{table(('key', 'unit', 'meaning'), rows)}\n"


_ANSWER = re.compile(r"(<!-- answer: (\w+) -->\n)(?:\|.*\n)*")
ANSWERS = {"read": FruitReading, "modulus": CompressionResult}
"""The records that commands print, by the name of the command."""


def answer_page(name: str) -> str:
    """Return a page with the tables of the keys that commands print, each behind a comment that names the command."""
    return _ANSWER.sub(answer_table, (DOCS / name).read_text(encoding="utf-8"))


def answer_table(found: re.Match[str]) -> str:
    """Return the comment of a table with the keys of the answer that it names."""
    rows = []
    for item in dataclasses.fields(ANSWERS[found[2]]):
        key = item.metadata.get("key", item.name)
        name = key if "`" in key else f"`{key}`"  # a field with several keys writes them itself
        if item.metadata.get("told", True):
            rows.append((name, item.metadata["unit"], item.metadata["meaning"]))
    return f"{found[1]}{table(('key of `--json`', 'unit', 'meaning'), rows)}\n"


def first_sentence(text: str) -> str:
    """Return a text up to the end of its first sentence or question."""
    return re.split(r"(?<=[.?]) ", text, maxsplit=1)[0]


PAGES = {
    "design-file.md": design_page,
    "words.md": words_page,
    "report-json.md": report_page,
    "read-a-fruit.md": partial(answer_page, "read-a-fruit.md"),
    "modulus.md": partial(answer_page, "modulus.md"),
}


def main() -> None:
    """Write every page."""
    for name, page in PAGES.items():
        (DOCS / name).write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
