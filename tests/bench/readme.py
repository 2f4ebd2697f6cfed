"""Put the last tables of the benches into the README, each between its markers, so that none is typed.

`python tests/bench/readme.py bench=outputs/bench/bench.md hard=outputs/bench/hard.md`: what stands between
`<!-- NAME -->` and `<!-- /NAME -->` becomes the text of the file.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

README = Path(__file__).parents[2] / "README.md"


def placed(readme: str, name: str, text: str) -> str:
    """Return the README with a text between the markers of a name; raises ValueError where they are missing."""
    start, end = f"<!-- {name} -->\n", f"<!-- /{name} -->"
    head, opening, rest = readme.partition(start)
    _, closing, tail = rest.partition(end)
    if not (opening and closing):
        msg = f"{name}: no markers {start.strip()} and {end} in the README; add them"
        raise ValueError(msg)
    return f"{head}{opening}{text.strip()}\n{closing}{tail}"


def main(pairs: Sequence[str]) -> None:
    """Place each NAME=FILE."""
    readme = README.read_text(encoding="utf-8")
    for pair in pairs:
        name, _, path = pair.partition("=")
        readme = placed(readme, name, Path(path).read_text(encoding="utf-8"))
    README.write_text(readme, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
