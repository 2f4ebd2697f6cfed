"""Fill in the templates of this package: text and tables for the terminal, and source code."""

import itertools
from pathlib import Path

from rich.console import RenderableType
from rich.markup import escape
from rich.table import Table

from cad.templates import template_environment
from sensor.quantity import COVERAGE
from sensor.words import value_with_bar

_FOLDER = Path(__file__).parent
_SEPARATOR = " | "  # separates the cells of a table


def render_template(template: str, number: object = repr, **values: object) -> str:
    """Return the text of a template, filled in with `values`.

    `number` is the function behind the template filter of that name, which formats a number, for example as a C
    literal. The filter `hex` formats a byte, and every template may use `value_with_bar` and `coverage`.
    """
    environment = template_environment(_FOLDER)
    environment.filters["number"] = number
    environment.filters["hex"] = "0x{:02X}".format
    return environment.get_template(template).render(values, value_with_bar=value_with_bar, coverage=COVERAGE)


def template_parts(template: str, **values: object) -> list[RenderableType]:
    """Return a filled-in template as text and tables for the terminal.

    Consecutive lines that contain ` | ` form a table, and the first of them is its header. All other lines are text.
    The first column is aligned to the left, and columns of numbers to the right. Square brackets are escaped, because
    Rich would interpret them as markup.
    """
    parts: list[RenderableType] = []
    lines = render_template(template, **values).splitlines()
    for is_table, block in itertools.groupby(lines, key=lambda line: _SEPARATOR in line):
        if not is_table:
            parts.append(escape("\n".join(block)))
            continue
        headings, *rows = (escape(line).split(_SEPARATOR) for line in block)
        table = Table()
        for index, heading in enumerate(headings):
            # On a narrow terminal, a long number is wrapped over two lines instead of truncated.
            table.add_column(heading.strip(), justify="right" if index else "left", overflow="fold")
        for row in rows:
            table.add_row(*row)
        parts.append(table)
    return parts
