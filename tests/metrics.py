"""What the code is like, in numbers: `python tests/metrics.py [FOLDER]` prints them, test_structure.py holds them.

Syntax nodes measure how much one has to read: a dense line has many of them, and folding lines does not change them.
"""

import ast
import functools
import re
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PACKAGES = ("cad", "mesh", "solve", "pipeline")
NUMERIC = re.compile(r"\b(float|Floats|Ints|ndarray|NDArray|Estimate)\b")
UNIT_OR_SHAPE = re.compile(r"\[[^\]]+\]|\bshape\b|\bunit\b|\bsame unit\b")
PAIR = re.compile(
    r"\blow, high\b|\bPair\b|\(2, 2\)|\(2, n|for tip in \(0, 1\)|\b1 - tip\b|K_low\b|K_high\b"
    r"|\bK_l\b|\.low\b|\"low\"|low_tip|\bF_l\b|leaf_thickness_low"
)
"""What a file says that takes the number of tips or springs for two, or names the low one."""


@dataclass(frozen=True, kw_only=True)
class Function:
    """One function: where it stands, its lines, its syntax nodes, its docstring, whether it is public and numeric."""

    place: str
    name: str
    lines: int
    nodes: int
    docstring: str
    public: bool
    numeric: bool

    @property
    def documented(self) -> bool:
        """Say whether the docstring names a unit or a shape."""
        return bool(UNIT_OR_SHAPE.search(self.docstring))


def sources(root: Path) -> list[Path]:
    """Return every source file of the four packages."""
    return sorted(path for package in PACKAGES for path in (root / package).rglob("*.py"))


@functools.cache
def nodes(text: str) -> tuple[ast.AST, ...]:
    """Return every syntax node of a source text, the module first; `nodes.cache_clear()` forgets them."""
    return tuple(ast.walk(ast.parse(text)))


def functions(root: Path) -> Iterator[Function]:
    """Yield every function of the four packages; one inside another counts to the outer one too."""
    for path in sources(root):
        yield from _functions_of(path.read_text(encoding="utf-8"), path.relative_to(root).as_posix())


@functools.cache
def _functions_of(text: str, place: str) -> tuple[Function, ...]:
    return tuple(_functions(nodes(text)[0], place, hidden=False))


def _functions(node: ast.AST, place: str, *, hidden: bool) -> Iterator[Function]:
    for child in ast.iter_child_nodes(node):
        inside = hidden
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            yield _function(child, place, hidden=hidden)
            inside = True
        elif isinstance(child, ast.ClassDef):
            inside = hidden or child.name.startswith("_")
        yield from _functions(child, place, hidden=inside)


def _function(node: ast.FunctionDef | ast.AsyncFunctionDef, place: str, *, hidden: bool) -> Function:
    text = ast.get_docstring(node) or ""
    a = node.args
    every = [*a.posonlyargs, *a.args, *a.kwonlyargs]
    hints = " ".join(ast.unparse(one) for one in [*(x.annotation for x in every), node.returns] if one is not None)
    statements = node.body[1:] if text else node.body
    return Function(
        place=f"{place}:{node.lineno}",
        name=node.name,
        lines=(node.end_lineno or node.lineno) - node.lineno + 1,
        nodes=sum(1 for statement in statements for _ in ast.walk(statement)),
        docstring=text,
        public=not (hidden or node.name.startswith("_")),
        numeric=bool(NUMERIC.search(hints)),
    )


def nodes_by_line(path: Path) -> list[int]:
    """Return how many syntax nodes begin on each line that has any; docstrings do not count."""
    count: Counter[int] = Counter()
    for node in nodes(path.read_text(encoding="utf-8")):
        if hasattr(node, "lineno") and not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
            count[node.lineno] += 1
    return list(count.values())


def quantile(values: list[int], share: float) -> int:
    """Return the value that a share of the values does not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0


def folded_code(root: Path) -> list[str]:
    """Return every `# fmt: skip` that does not end a table of data: a literal, or a call of literals."""
    found = []
    for path in sources(root):
        text = path.read_text(encoding="utf-8")
        lines = text.splitlines()
        for node in nodes(text):
            simple = isinstance(node, ast.stmt) and not hasattr(node, "body")
            if simple and "# fmt: skip" in lines[node.end_lineno - 1] and not _is_data(node):
                found.append(f"{path.relative_to(root)}:{node.lineno}")
    return found


def _is_data(node: ast.stmt) -> bool:
    """Say whether a statement binds constants in capitals."""
    names = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return bool(names) and all(isinstance(name, ast.Name) and name.id.isupper() for name in names)


def pair_files(root: Path) -> list[str]:
    """Return the files in which the number of tips is assumed to be two."""
    return [p.relative_to(root).as_posix() for p in sources(root) if PAIR.search(p.read_text(encoding="utf-8"))]


def main(root: Path) -> None:
    """Print the numbers, folder by folder and in all."""
    rooms: Counter[str] = Counter()
    files: Counter[str] = Counter()
    for path in sources(root):
        room = path.parent.relative_to(root).as_posix()
        rooms[room] += len(path.read_text(encoding="utf-8").splitlines())
        files[room] += path.name != "__init__.py"
    for room in sorted(rooms):
        print(f"{room:24} {files[room]:3} files {rooms[room]:6} lines")
    every = list(functions(root))
    sizes = [one.nodes for one in every]
    per_line = [count for path in sources(root) for count in nodes_by_line(path)]
    numeric = [one for one in every if one.public and one.numeric]
    text = "".join(path.read_text(encoding="utf-8") for path in sources(root))
    print(f"all: {sum(files.values())} files, {sum(rooms.values())} lines, largest folder {max(files.values())} files")
    print(f"functions: nodes p50 {quantile(sizes, 0.5)} p90 {quantile(sizes, 0.9)} max {max(sizes)}")
    print(f"nodes a line: p50 {quantile(per_line, 0.5)} p90 {quantile(per_line, 0.9)} max {max(per_line)}")
    print(f"dict[str, Any]: {text.count('dict[str, Any]')}, Mapping[str, Any]: {text.count('Mapping[str, Any]')}")
    print(f"fmt: skip: {text.count('# fmt: skip')}, not data: {len(folded_code(root))}")
    print(f"files that assume two tips: {len(pair_files(root))}")
    good = sum(one.documented for one in numeric)
    print(f"numeric public docstrings with unit or shape: {good} of {len(numeric)} = {good / len(numeric):.1%}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1])
