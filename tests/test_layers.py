"""Imports run one way, cad <- mesh <- solve <- pipeline, and each third-party package has one owner folder.

Every rule is a function from a source tree to a list of faults: empty for this repository, and not empty for a
tree with one planted fault.
"""

import ast
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("cad", "mesh", "solve", "pipeline")

ALLOWED = {"cad": {"cad"}, "mesh": {"cad", "mesh"}, "solve": {"cad", "solve"}, "pipeline": set(PACKAGES)}
"""Which packages of the project a package imports; solve takes a plain scikit-fem mesh, so it needs no mesh."""

SOLVE_TAKES_OF_CAD = {"cad.parameters", "cad.quantity", "cad.springs", "cad.materials"}
SIZING = (
    "parameters",
    "design_file",
    "quantity",
    "springs",
    "blade",
    "materials",
    "printable",
    "gauges",
    "flexure",
    "feet",
)

OWNERS = {
    "OCP": {"cad"},
    "cadquery": {"cad"},
    "ezdxf": {"cad"},
    "gmsh": {"mesh"},
    "lib3mf": {"cad"},
    "manifold3d": {"cad"},
    "matplotlib": {"pipeline"},
    "meshio": {"pipeline"},
    "numpy": set(PACKAGES),
    "pypardiso": {"solve"},
    "pyvista": {"pipeline"},
    "rich": {"pipeline"},
    "rtree": {"cad"},
    "scipy": set(PACKAGES),
    "scipy.sparse": {"solve"},
    "shapely": {"cad"},
    "skfem": {"mesh", "solve"},
    "skfem.assembly": {"solve"},
    "skfem.helpers": {"solve"},
    "skfem.models": {"solve"},
    "skfem.utils": {"solve"},
    "trimesh": {"cad"},
    "vtk": {"pipeline"},
}
"""The folders that may import a package; the longest name that fits decides."""

FORMS = {"BilinearForm", "LinearForm", "Functional", "TrilinearForm", "asm", "solve", "condense", "enforce", "penalize"}
"""Names at the top of skfem that make or solve equations; they belong to solve, as skfem.assembly does."""

OPTIONAL = {"pypardiso"}
DEFERRED_ONLY_IN = "pipeline.cli"
VAGUE = {"utils", "util", "common", "helpers", "helper", "core", "base", "misc"}

Rule = Callable[[Path], list[str]]


@dataclass(frozen=True, kw_only=True)
class Import:
    """One imported name, where it stands, and whether it waits for a function to be called."""

    module: str  # the module that imports
    target: str  # what it imports, with the name after `import` where there is one
    line: int
    deferred: bool

    @property
    def package(self) -> str:
        """Return the folder that the importing module lies in."""
        return self.module.partition(".")[0]

    @property
    def top(self) -> str:
        """Return the first part of what is imported."""
        return self.target.partition(".")[0]

    def __str__(self) -> str:
        return f"{self.module}:{self.line} imports {self.target}"


def sources(root: Path) -> dict[str, Path]:
    """Return every module of the four packages by its dotted name; a package stands under its own name."""
    found = {}
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(root: Path) -> list[Import]:
    """Return every import of the four packages, inside functions and by name too."""
    found = []
    for module, path in sources(root).items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        within = module if path.name == "__init__.py" else module.rpartition(".")[0]
        for node, deferred in _walk(tree, deferred=False):
            found += [
                Import(module=module, target=target, line=node.lineno, deferred=deferred)
                for target in _targets(node, within)
            ]
    return found


def _walk(node: ast.AST, *, deferred: bool) -> Iterator[tuple[ast.AST, bool]]:
    for child in ast.iter_child_nodes(node):
        yield child, deferred
        inside = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        yield from _walk(child, deferred=deferred or inside)


def _targets(node: ast.AST, within: str) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        above = within.split(".")[: len(within.split(".")) - node.level + 1] if node.level else []
        start = ".".join([*above, *([node.module] if node.module else [])])
        return [f"{start}.{alias.name}" for alias in node.names]
    if isinstance(node, ast.Call):
        called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if called in ("import_module", "__import__"):
            name = node.args[0] if node.args else None
            return [str(name.value) if isinstance(name, ast.Constant) else "<a name computed at run time>"]
    return []


def _home(target: str, known: Mapping[str, object]) -> str | None:
    """Return the longest dotted start of a target that is known."""
    parts = target.split(".")
    starts = (".".join(parts[:count]) for count in range(len(parts), 0, -1))
    return next((start for start in starts if start in known), None)


def _standard(item: Import) -> bool:
    return item.top in sys.stdlib_module_names


def imports_against_the_order(root: Path) -> list[str]:
    """Fault every import of a package of the project that the importing package may not see."""
    return [str(i) for i in imports(root) if i.top in PACKAGES and i.top not in ALLOWED[i.package]]


def solve_takes_more_of_cad(root: Path) -> list[str]:
    """Fault every import of cad by solve beyond numbers and laws."""
    modules = sources(root)
    return [
        str(i)
        for i in imports(root)
        if i.package == "solve" and i.top == "cad" and _home(i.target, modules) not in SOLVE_TAKES_OF_CAD
    ]


def third_party_outside_its_owner(root: Path) -> list[str]:
    """Fault every third-party import without an owner in the table, or outside its owner's folder."""
    found = []
    for i in imports(root):
        if _standard(i) or i.top in PACKAGES:
            continue
        owner = _home(i.target, OWNERS)
        if owner is None:
            found.append(f"{i}: give it an owner in tests/test_layers.py")
        elif i.package not in OWNERS[owner]:
            found.append(f"{i}: belongs to {', '.join(sorted(OWNERS[owner]))}")
        elif i.top == "skfem" and i.target.rpartition(".")[2] in FORMS and i.package != "solve":
            found.append(f"{i}: belongs to solve")
    return found


def deferred_imports(root: Path) -> list[str]:
    """Fault every import inside a function or by name, but for the command line and optional packages."""
    return [
        str(i)
        for i in imports(root)
        if (i.deferred and i.module != DEFERRED_ONLY_IN and i.top not in OPTIONAL) or i.target.startswith("<")
    ]


def optional_imports_that_do_not_wait(root: Path) -> list[str]:
    """Fault every import of an optional package at the top of a module: it would break where it is not installed."""
    return [str(i) for i in imports(root) if i.top in OPTIONAL and not i.deferred]


def heavy_sizing_modules(root: Path) -> list[str]:
    """Fault every import of the sizing modules beyond the standard library and each other; packages import nothing."""
    light = {f"cad.{name}" for name in SIZING}
    modules = sources(root)
    return [
        str(i)
        for i in imports(root)
        if (i.module in light and not _standard(i) and _home(i.target, modules) not in light) or i.module in PACKAGES
    ]


def import_cycles(root: Path) -> list[str]:
    """Fault the first ring of modules that import each other, deferred imports included."""
    modules = sources(root)
    graph: dict[str, set[str]] = {module: set() for module in modules}
    for i in imports(root):
        home = _home(i.target, modules)
        if home is not None:
            graph[i.module].add(home)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return [" <- ".join(error.args[1])]
    return []


def vague_names(root: Path) -> list[str]:
    """Fault every file or folder whose name says nothing about what it holds."""
    folders = [root / folder for folder in (*PACKAGES, "tests")]
    paths = [path for folder in folders for path in (folder, *folder.rglob("*"))]
    return [str(path) for path in paths if path.suffix in ("", ".py") and path.stem in VAGUE]


def init_files_in_tests(root: Path) -> list[str]:
    """Fault `tests/cad/__init__.py` and the like: they would hide the package of that name."""
    return [str(path) for path in (root / "tests").rglob("__init__.py")]


PLANTED: list[tuple[Rule, dict[str, str], str]] = [
    (imports_against_the_order, {"cad/part.py": "import mesh.volume"}, "cad.part:1 imports mesh.volume"),
    (imports_against_the_order, {"mesh/volume.py": "from solve import linear"}, "mesh.volume:1 imports solve.linear"),
    (imports_against_the_order, {"solve/linear.py": "from mesh.volume import Mesh"}, "imports mesh.volume.Mesh"),
    (imports_against_the_order, {"solve/linear.py": "def f():\n    import pipeline.run"}, ":2 imports pipeline.run"),
    (imports_against_the_order, {"cad/part.py": "from ..mesh import volume"}, "cad.part:1 imports"),
    (solve_takes_more_of_cad, {"cad/part.py": "", "solve/linear.py": "from cad import part"}, "imports cad.part"),
    (solve_takes_more_of_cad, {"solve/linear.py": "import cad"}, "imports cad"),
    (third_party_outside_its_owner, {"solve/linear.py": "import gmsh"}, "imports gmsh: belongs to mesh"),
    (third_party_outside_its_owner, {"mesh/volume.py": "import cadquery as cq"}, "cadquery: belongs to cad"),
    (third_party_outside_its_owner, {"mesh/a.py": "from scipy.sparse.linalg import splu"}, "splu: belongs to solve"),
    (third_party_outside_its_owner, {"mesh/a.py": "from scipy import sparse"}, "sparse: belongs to solve"),
    (third_party_outside_its_owner, {"mesh/a.py": "from skfem import MeshTet, BilinearForm"}, "Form: belongs to solve"),
    (third_party_outside_its_owner, {"mesh/a.py": "import skfem.helpers"}, "helpers: belongs to solve"),
    (third_party_outside_its_owner, {"cad/part.py": "import pyvista"}, "pyvista: belongs to pipeline"),
    (third_party_outside_its_owner, {"cad/part.py": "import unheard_of"}, "unheard_of: give it an owner"),
    (deferred_imports, {"cad/part.py": "def f():\n    import cadquery"}, "cad.part:2 imports cadquery"),
    (deferred_imports, {"pipeline/run.py": "class A:\n    def f(self):\n        import gmsh"}, "run:3 imports gmsh"),
    (deferred_imports, {"cad/part.py": "def f():\n    return import_module('json')"}, "cad.part:2 imports json"),
    (deferred_imports, {"pipeline/cli.py": "import importlib\nimportlib.import_module(x)"}, "computed at run time"),
    (optional_imports_that_do_not_wait, {"solve/linear.py": "import pypardiso"}, "imports pypardiso"),
    (heavy_sizing_modules, {"cad/springs.py": "import numpy as np"}, "cad.springs:1 imports numpy"),
    (heavy_sizing_modules, {"cad/part.py": "", "cad/blade.py": "from cad.part import Part"}, "imports cad.part"),
    (heavy_sizing_modules, {"cad/__init__.py": "from cad.springs import Springs"}, "cad:1 imports cad.springs"),
    (import_cycles, {"cad/a.py": "import cad.b", "cad/b.py": "from cad.a import x"}, "cad.a"),
    (import_cycles, {"cad/a.py": "def f():\n    import cad.b", "cad/b.py": "from cad import a"}, "cad.a"),
    (vague_names, {"cad/utils.py": ""}, "utils.py"),
    (vague_names, {"tests/helpers/data.txt": ""}, "helpers"),
    (init_files_in_tests, {"tests/cad/__init__.py": ""}, "__init__.py"),
]
RULES = sorted({rule for rule, _, _ in PLANTED}, key=lambda rule: rule.__name__)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_repository_keeps_the_rule(rule: Rule) -> None:
    assert rule(ROOT) == []


@pytest.mark.parametrize(("rule", "files", "fault"), PLANTED)
def test_planted_fault_is_found(
    rule: Rule, files: Mapping[str, str], fault: str, plant: Callable[[Mapping[str, str]], Path]
) -> None:
    found = rule(plant(files))
    assert len(found) == 1
    assert fault in found[0]


def test_every_package_is_read() -> None:
    assert {module.partition(".")[0] for module in sources(ROOT)} == set(PACKAGES)


def test_command_line_may_wait_with_its_imports(plant: Callable[[Mapping[str, str]], Path]) -> None:
    root = plant({"pipeline/cli.py": "def f():\n    import pipeline.run\n", "pipeline/run.py": "import gmsh"})
    assert deferred_imports(root) == []
