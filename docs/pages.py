"""Write design-file.md, words.md and the tables of report-json.md from the program's own data.

`python docs/pages.py` writes them. The meaning of a key stands beside its field.
"""

import dataclasses
import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))

from pipeline.report.explain.entries import entries  # noqa: E402
from pipeline.report.keys import report_keys  # noqa: E402
from sensor.design.design_file import TABLE_TYPES  # noqa: E402
from sensor.design.processes import PROCESSES, Process  # noqa: E402

DESIGN_HEAD = """\
# The design file

*Written by `docs/pages.py` from the program's own parameters.*

A design file is TOML text. It holds every number that a person may choose. A key that is left out has its default,
which is the sensor of the paper that twintip starts from. An unknown key is refused, and the message names the nearest
known one. A key of an older version that is gone is refused too, and the message says what to do. A key carries its
unit; one without is a plain number.

    name = "mine"

    [targets]
    NL = 0.03

    [fruit]
    height_mm = 20.0

Use it with `pipeline run --design mine.toml`. One key can also be set on the command line, on top of the file:
`pipeline run --set fruit.height_mm=20`. The presets `paper`, `paper-on-mango` and `mango`, those of `kiwi`, `apple`,
`peach`, `avocado` and `tomato`, and that of all six, `fruit`, are the files in [designs](../designs), each number with
its source; `--design mango` uses one, and [presets](presets.md) says which to take. Every output folder holds a
`design.toml` that repeats its run. Three tips in a line have no housing, as [fouly.toml](examples/fouly.toml). They are
judged by their readings, or by their force ratio where the design has no `[reading]`, see
[layouts](presets.md#layouts-of-tips).

`name` is text of 1 to 64 letters, digits, `-` or `_`; it names the output folder and is engraved in the part. A file
without a name is named after the file.
"""

DESIGN_TAIL = """\
## What several keys decide together

- The tips stand on the fruit and do not overlap: `tips.spacing_mm` is greater than `tips.side_mm`.
- `tips.fillet_mm` is less than half of `tips.side_mm`; a sphere has none.
- `press.travel_mm` is less than the height of the fruit, or its thickness where that is given.
- A block has no radii. A sphere needs `radius_mm`; an ellipsoid needs `radius_mm` and `radius_across_mm`.
- The piece of curved fruit lies on the fruit: its corners stay above its base.
- `springs` holds both stiffnesses or none, the low one less than the high one.
- A tip face meets the fruit at 20 degrees at most; a steeper scene is refused.
- The printed tips are sharp squares, or domes on squares. Another shape or a fillet is refused unless
  `tips.socket = "pin"`: ground pins have any shape.
- Half the face of a dome holds the contact, or the verdict `geometry.tip_face` fails.
- A square is printed as two equal plates back to back: `tips.spacing_mm` holds a plate as deep as a tip is wide, and
  the pads between the plates, 0.4 or 0.5 mm.
- A line of three has no housing: its springs are those of `[springs]`, and `pipeline design` refuses it.
- `print.leaves = "spring-steel"` takes strips of sold sheet, glued into slots of a plastic print; a process of metal, a
  line of three and gauges are refused beside it. The sheet is the thinnest whose stiffness scatters by at most 5 % once
  it is weighed, or the one that `leaf_thickness_low_mm` and `leaf_thickness_high_mm` name: 0.1, 0.15, 0.2, 0.25, 0.3
  or 0.4 mm. Weigh each sheet, give what it measures as `leaf_measured_low_mm` and `leaf_measured_high_mm`, and print
  the frame anew: its free lengths are fitted to the sheet at hand.

A pair lies along the length of the fruit, the low tip at -x, the high tip at +x; a line too, in its order. A square
goes round from (-x, -y): low, high, low, high. With tilt, roll, curved fruit, fillets or spheres a tip may touch in
part or lift off. The springs are then sized for the flat block of the same size under sharp flat tips, and the response
is that of the scene as it is.

Lines and squares need `[springs]`: targets size a pair only. With `[springs]` and without `[targets]`, P_max and NL are
facts that are not judged. With `[reading]` the design is judged by the modulus that it reads, in place of the verdicts
on P. With `[readout]` the noise of the forces is computed: `reading.noise_percent` and `noise_N` are then left out.
`readout.transducer = "foil"` needs `print.gauges = "foil"`, "displacement" needs "none"; a process of your own needs
`E_per_K`.
"""

PROCESS_HEAD = """\
## Print processes

The terminal shows the same with
`pipeline design --list-processes`.

Each can make the default design; how exactly is shown in
[springs of each process](measurements.md#springs-of-each-process).

Leaf thicknesses of the filament processes are multiples of the printer's line: the low leaf is two lines of 0.4 mm,
the high one three. These are the first and a middle layer in the slicer:

![the paths of the nozzle in the first and in a middle layer of the housing](slices.png)

Sources that begin with "typical" are values in common use that were not checked against a data sheet. All others were
read where they say. They set the first print: calibrate each printed unit before its numbers are trusted.
"""

PROCESS_TAIL = """\
### A printer of your own

Copy the table of the process that is nearest to yours from `sensor/design/processes.toml` into a file of your own, give
it a new name, and change what you have measured. Every number needs its source, and one that is out of bounds or
unknown is refused in a line. Without `creep_per_decade` and `creep_scatter` its springs count as elastic. `kind` is
fdm, sla, sls, dmls or other: it decides what the fabrication sheet says of supports, washing, heat and powder. Name the
file in the design, with its path from the design file:

    [print]
    process_file = "my-printer.toml"

A file with several processes needs `process = "NAME"` beside it. The process itself, with its sources, then stands in
`design.toml` and in `report.json` of every output folder as the table `printer`, so the folder stands alone.
`pipeline design --list-processes` shows it too where the design is named.
"""

WORDS_HEAD = """\
# Verdicts, words and symbols

*Written by `docs/pages.py`.* `pipeline explain NAME` says more of each, its formula and its source, and with
`--out DIR` the number of a run. Units are mm, N and MPa; a key or a label that uses another one says so.
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
    return "\n".join([*parts, DESIGN_TAIL, process_section()])


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
    parts = [PROCESS_HEAD, table(heads, rows) + "\n", "### Where each number comes from\n"]
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


def first_sentence(text: str) -> str:
    """Return a text up to the end of its first sentence or question."""
    return re.split(r"(?<=[.?]) ", text, maxsplit=1)[0]


PAGES = {
    "design-file.md": design_page,
    "words.md": words_page,
    "report-json.md": report_page,
}


def main() -> None:
    """Write every page."""
    for name, page in PAGES.items():
        (DOCS / name).write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
