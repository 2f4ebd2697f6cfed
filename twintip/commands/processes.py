"""The table of print processes, with the sources of all values."""

import dataclasses

from rich.table import Column, Table
from rich.text import Text

from sensor.design.processes import PROCESSES, Process
from twintip.commands.console import PASSED, Answer

_WIDTH = 160  # [characters], enough for one column per process

_OWN_PROCESS = 'To use your own printer, set process_file = "my-printer.toml" in [print]; see docs/design-file.md.'


def process_list(own: Process | None) -> Answer:
    """Return a table with one column for each print process, and the sources of all values below it.

    `own` is the process that the design defines in its own file, or None. This process is in the last column.
    """
    processes = list(PROCESSES.values())
    if own is not None:
        processes.append(own)
    records = [dataclasses.asdict(process) for process in processes]
    headings = ("", *(record["name"] for record in records))
    table = Table(*(Column(heading, overflow="fold") for heading in headings), title="print processes")
    # Each row is one property of all processes. The names are the headings, and the sources follow the table.
    for key in records[0]:
        if key not in ("name", "sources"):
            table.add_row(key, *(str(record[key]) for record in records))
    source_lines = []
    for process in processes:
        sources_text = " ".join(f"{field}: {text};" for field, text in process.sources)
        source_lines.append(Text(f"{process.name}: {sources_text}"))
    return Answer(code=PASSED, data=records, parts=[table, *source_lines], text=_OWN_PROCESS, width=_WIDTH)
