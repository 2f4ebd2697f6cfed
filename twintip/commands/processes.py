"""The print processes as a table: all numbers with their sources."""

import dataclasses

from rich.table import Column, Table
from rich.text import Text

from sensor.design.processes import PROCESSES, Process
from twintip.commands.console import PASSED, Answer

_WIDTH = 160  # [characters], for a column of each process

_OWN = 'A printer of your own: [print] process_file = "my-printer.toml" in the design file, see docs/design-file.md.'


def process_list(own: Process | None) -> Answer:
    """Return every process with its numbers in one column, and the design's own process if it has one."""
    processes = [*PROCESSES.values(), *([] if own is None else [own])]
    records = [dataclasses.asdict(process) for process in processes]
    heads = ("", *(record["name"] for record in records))
    table = Table(*(Column(head, overflow="fold") for head in heads), title="print processes")
    for key in records[0]:
        if key not in ("name", "sources"):
            table.add_row(key, *(str(record[key]) for record in records))
    sources = []
    for process in processes:
        sources_text = " ".join(f"{field}: {text};" for field, text in process.sources)
        sources.append(Text(f"{process.name}: {sources_text}"))
    return Answer(code=PASSED, data=records, parts=[table, *sources], text=_OWN, width=_WIDTH)
