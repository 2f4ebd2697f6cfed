"""The print processes as a table: every number of each, and where it comes from."""

import dataclasses
import sys

from rich.console import Console
from rich.table import Table

from cad.design.processes import PROCESSES
from pipeline.commands.console import print_json


def list_processes(*, as_json: bool) -> int:
    """Print every process with its numbers, one column each, as they stand in cad/design/processes.toml; return 0."""
    records = [dataclasses.asdict(process) for process in PROCESSES.values()]
    if as_json:
        print_json(records)
        return 0
    table = Table("", *(record["name"] for record in records), title="print processes")
    for key in records[0]:
        if key not in ("name", "sources"):
            table.add_row(key, *(str(record[key]) for record in records))
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(table)
    for process in PROCESSES.values():
        console.print(f"{process.name}:", *(f"{field}: {text};" for field, text in process.sources), highlight=False)
    return 0
