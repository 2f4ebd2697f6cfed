"""Templates of this package: answers as tables and sentences, and source code."""

import itertools
from pathlib import Path

from rich.console import RenderableType
from rich.markup import escape
from rich.table import Table

from cad.templates import template_environment
from sensor.quantity import COVERAGE
from sensor.words import value_with_bar

_ROOM = Path(__file__).parent
_BAR = " | "


def render_template(template: str, number: object = repr, **values: object) -> str:
    """Return the text of a template, filled with `values`.

    `number` is the function that the template's filter `number` applies to a number, for example a C literal.
    """
    environment = template_environment(_ROOM)
    environment.filters["number"] = number
    environment.filters["hex"] = "0x{:02X}".format
    return environment.get_template(template).render(values, value_with_bar=value_with_bar, coverage=COVERAGE)


def template_parts(template: str, **values: object) -> list[RenderableType]:
    """Return a filled template as texts and tables for the terminal.

    Consecutive lines that contain ` | ` are a table, and the first of them is its header. Other lines are text.
    """
    parts: list[RenderableType] = []
    lines = render_template(template, **values).splitlines()
    for is_table, block in itertools.groupby(lines, key=lambda line: _BAR in line):
        if not is_table:
            parts.append(escape("\n".join(block)))
            continue
        heads, *rows = (escape(line).split(_BAR) for line in block)
        table = Table()
        for index, head in enumerate(heads):
            # A narrow terminal wraps a number over two lines, and truncates none.
            table.add_column(head.strip(), justify="right" if index else "left", overflow="fold")
        for row in rows:
            table.add_row(*row)
        parts.append(table)
    return parts
