"""Write the examples at the end of python.md from their scripts: what each one shows, and what it prints.

`python docs/gallery.py` runs them all, in a minute or two, in a folder of their own.
"""

import ast
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
PAGE = ROOT / "docs" / "python.md"

ORDER = (
    "two_spring_law", "figures_of_the_paper", "cut_into_an_assembly", "own_housing", "your_own_printer",
    "contact_and_closed_form", "fields_in_pyvista", "study_as_a_table", "optimum", "press_read", "firmware",
)  # fmt: skip
PICTURES = {
    "figures_of_the_paper": "figures-9-and-11.png",
    "fields_in_pyvista": "stress-of-the-springs.png",
}
"""The picture that a script writes into its outputs; a copy stands in docs."""

MARK = "<!-- examples -->\n"
"""The comment in the page before the first example."""


def run_example(name: str, folder: Path) -> str:
    """Run an example in a folder, and return what it prints."""
    environment = {**os.environ, "PYTHONPATH": os.fspath(ROOT)}
    finished = subprocess.run(
        [sys.executable, EXAMPLES / f"{name}.py"],
        cwd=folder, env=environment, check=True, stdout=subprocess.PIPE, encoding="utf-8", timeout=600,
    )  # fmt: skip
    return finished.stdout


def section(name: str, printed: str) -> str:
    """Return the section of an example: its title and text, its picture, and what it prints."""
    script = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    docstring = ast.get_docstring(ast.parse(script)) or ""
    title, _, text = docstring.partition(": ")
    lines = [f"### {title}", "", f"{text[:1].upper()}{text[1:]} [{name}.py](../examples/{name}.py)"]
    if name in PICTURES:
        lines += ["", f"![{title}]({PICTURES[name]})"]
    return "\n".join([*lines, "", "```text", printed.rstrip("\n"), "```", ""])


def main() -> None:
    """Run all examples and write the section with copies of their pictures."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        sections = [section(name, run_example(name, folder)) for name in ORDER]
        for picture in PICTURES.values():
            (ROOT / "docs" / picture).write_bytes((folder / "outputs" / picture).read_bytes())
    before, mark, _ = PAGE.read_text(encoding="utf-8").partition(MARK)
    PAGE.write_text("\n".join([before + mark, *sections]), encoding="utf-8")


if __name__ == "__main__":
    main()
