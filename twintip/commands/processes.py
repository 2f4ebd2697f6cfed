"""The print processes as a table: every number of each, and where it comes from."""

import dataclasses
import sys

from rich.console import Console
from rich.table import Table

from sensor.design.processes import PROCESSES, Process
from twintip.commands.console import print_json

_OWN = 'A printer of your own: [print] process_file = "my-printer.toml" in the design file, see docs/design-file.md.'


def list_processes(own: Process | None, *, as_json: bool) -> int:
    """Print every process with its numbers, one column each, and the design's own where it has one; return 0."""
    processes = [*PROCESSES.values(), *([] if own is None else [own])]
    records = [dataclasses.asdict(process) for process in processes]
    if as_json:
        print_json(records)
        return 0
    table = Table("", *(record["name"] for record in records), title="print processes")
    for key in records[0]:
        if key not in ("name", "sources"):
            table.add_row(key, *(str(record[key]) for record in records))
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(table)
    for process in processes:
        console.print(f"{process.name}:", *(f"{field}: {text};" for field, text in process.sources), highlight=False)
    console.print(_OWN, highlight=False, markup=False, soft_wrap=True)
    return 0
