"""Imports run one way, cad <- mesh <- solve <- pipeline, and each third-party package has one owner folder.

Every rule is a function from a source tree to a list of faults: empty for this repository, and not empty for a
tree with one planted fault.
"""

import ast
import functools
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("cad", "mesh", "solve", "pipeline")

NUMBERS = ("cad.quantity", "cad.verdict")
LAWS = (*NUMBERS, "cad.theory", "cad.design")
SHAPES = (*LAWS, "cad.kernel", "cad.triangles", "cad.parts")
CELLS = ("mesh.cells", "mesh.cell_facets")
ELASTIC = (
    *CELLS,
    "solve.arrays",
    "solve.displacement_basis",
    "solve.elasticity",
    "solve.linear",
    "solve.error_estimate",
    "solve.surface",
    "solve.nodal_fields",
)
BELOW = ("cad", "mesh", "solve")
STAGES = (
    *BELOW,
    "pipeline.progress",
    "pipeline.options",
    "pipeline.storage",
    "pipeline.modeller",
    "pipeline.fit",
    "pipeline.stages",
)
READ = (*STAGES, "pipeline.reading")
JUDGED = (*READ, "pipeline.verdicts")
SENTENCES = (*JUDGED, "pipeline.uncertainty", "pipeline.result", "pipeline.report")
AFTER = (
    "pipeline.check",
    "pipeline.page",
    "pipeline.view",
    "pipeline.compression",
    "pipeline.unit",
    "pipeline.explain",
)
"""Rooms that start from an output folder or a file of the user; none sees another."""

MAY_SEE: dict[str, tuple[str, ...]] = {
    "cad.quantity": (),
    "cad.verdict": ("cad.quantity",),
    "cad.theory": NUMBERS,
    "cad.design": (*NUMBERS, "cad.theory"),
    "cad.kernel": (),
    "cad.triangles": (),
    "cad.parts": (*LAWS, "cad.kernel", "cad.triangles"),
    "cad.files": SHAPES,
    "cad.drawing": (*SHAPES, "cad.files"),
    "cad.checks": (*SHAPES, "cad.files"),
    "cad.workshop": (*SHAPES, "cad.files", "cad.drawing", "cad.checks"),
    "mesh.session": ("cad.quantity",),
    "mesh.gmsh_arrays": ("mesh.session",),
    "mesh.quality": ("cad.quantity", "mesh.session", "mesh.gmsh_arrays"),
    "mesh.cells": (),
    "mesh.cell_facets": ("mesh.cells",),
    "mesh.volume": (*SHAPES, "mesh.session", "mesh.gmsh_arrays", "mesh.quality"),
    "mesh.fruit": (*SHAPES, "mesh.volume"),
    "mesh.housing": (*SHAPES, *CELLS, "mesh.session", "mesh.gmsh_arrays", "mesh.quality"),
    "solve.arrays": (),
    "solve.displacement_basis": ("mesh.cells", "solve.arrays"),
    "solve.elasticity": (*LAWS, "solve.arrays", "solve.displacement_basis"),
    "solve.memory": (),
    "solve.linear": (*LAWS, "solve.arrays", "solve.memory"),
    "solve.surface": (*LAWS, *CELLS, "solve.arrays"),
    "solve.error_estimate": LAWS,
    "solve.nodal_fields": (*LAWS, "solve.arrays", "solve.elasticity"),
    "solve.halfspace": (*LAWS, *ELASTIC),
    "solve.fruit": (*LAWS, *ELASTIC, "solve.halfspace"),
    "solve.contact": (*LAWS, *ELASTIC, "solve.halfspace", "solve.fruit", "solve.large_strain"),
    "solve.housing": (*LAWS, *ELASTIC),
    "solve.large_strain": (*LAWS, *ELASTIC),
    "pipeline.options": LAWS,
    "pipeline.limits": ("cad.quantity",),
    "pipeline.progress": (),
    "pipeline.failures": (),
    "pipeline.storage": (*LAWS, "pipeline.progress", "pipeline.modeller.answer"),
    "pipeline.modeller.answer": (),
    "pipeline.modeller": (*SHAPES, "cad.files.file_date", "pipeline.failures", "pipeline.storage"),
    "pipeline.modeller.sensor_files": ("cad", "pipeline.modeller"),
    "pipeline.modeller.maker_files": ("cad", "pipeline.modeller"),
    "pipeline.modeller.tasks": (
        "cad",
        "pipeline.modeller",
        "pipeline.storage",
        "pipeline.page.bodies",
        "pipeline.page.solid_pictures",
    ),
    "pipeline.answer": (*LAWS, "cad.files.file_date", "pipeline.options", "pipeline.storage"),
    "pipeline.fit": (*BELOW, "pipeline.options", "pipeline.storage", "pipeline.modeller"),
    "pipeline.stages": (*BELOW, "pipeline.options", "pipeline.storage", "pipeline.modeller", "pipeline.fit"),
    "pipeline.stages.fabrication": JUDGED,
    "pipeline.reading": STAGES,
    "pipeline.verdicts": READ,
    "pipeline.uncertainty": JUDGED,
    "pipeline.result": (*JUDGED, "pipeline.uncertainty"),
    "pipeline.remedies": (*JUDGED, "pipeline.uncertainty", "pipeline.result"),
    "pipeline.report": (*JUDGED, "pipeline.uncertainty", "pipeline.result", "pipeline.answer"),
    "pipeline.check": (*SENTENCES, "pipeline.limits"),
    "pipeline.page.drawing": (),
    "pipeline.page": SENTENCES,
    "pipeline.view": (*SENTENCES, "pipeline.decks"),
    "pipeline.compression": (*LAWS, "pipeline.options", "pipeline.storage"),
    "pipeline.unit": (*SHAPES, "pipeline.storage", "pipeline.report.stored"),
    "pipeline.explain": SENTENCES,
    "pipeline.run": (*SENTENCES, "pipeline.remedies", "pipeline.page"),
    "pipeline.suggest": (*SENTENCES, "pipeline.remedies", "pipeline.run", "pipeline.judged"),
    "pipeline.study": ("pipeline.failures", *SENTENCES, "pipeline.remedies", "pipeline.run", "pipeline.judged"),
    "pipeline.decks": (*BELOW, "pipeline.storage"),
    "pipeline.bench": (*STAGES, "pipeline.decks", "pipeline.page.drawing"),
    "pipeline.commands": (
        *SENTENCES,
        *AFTER,
        "pipeline.answer",
        "pipeline.remedies",
        "pipeline.suggest",
        "pipeline.limits",
        "pipeline.run",
        "pipeline.bench",
        "pipeline.study",
    ),
    "pipeline.cli": ("cad.quantity", "pipeline.limits", "pipeline.options", "pipeline.storage", "pipeline.commands"),
    "pipeline.__main__": ("pipeline.cli",),
}
"""What each room imports of the project, beside itself; the longest name that fits decides."""

LIGHT = ("cad.quantity", "cad.verdict", "cad.theory", "cad.design", "pipeline.options")
"""Rooms that import the standard library and each other only: help, refusals and sizing are instant."""

MOST_FILES = 12
"""In one folder, its `__init__.py` not counted: what one can take in at a glance."""

OWNERS = {
    "aiohttp": {"pipeline"},
    "OCP": {"cad"},
    "cadquery": {"cad"},
    "cattrs": {"pipeline"},
    "distributed": {"pipeline"},
    "ezdxf": {"cad"},
    "gmsh": {"mesh"},
    "jinja2": {"pipeline"},
    "lib3mf": {"cad"},
    "manifold3d": {"cad"},
    "matplotlib": {"pipeline"},
    "meshio": {"pipeline"},
    "numpy": set(PACKAGES),
    "pyarrow": {"pipeline"},
    "pypardiso": {"solve"},
    "pyvista": {"pipeline"},
    "rich": {"pipeline"},
    "rtree": {"cad"},
    "scipy": set(PACKAGES),
    "scipy.sparse": {"solve"},
    "shapely": {"cad"},
    "shtab": {"pipeline"},
    "skfem": {"mesh", "solve"},
    "skfem.assembly": {"solve"},
    "skfem.helpers": {"solve"},
    "skfem.models": {"solve"},
    "skfem.utils": {"solve"},
    "trame": {"pipeline"},
    "trame_vtk": {"pipeline"},
    "trame_vuetify": {"pipeline"},
    "trimesh": {"cad"},
    "vtk": {"pipeline"},
    "vtkmodules": {"pipeline"},
}
"""The folders that may import a package; the longest name that fits decides."""

FORMS = {"BilinearForm", "LinearForm", "Functional", "TrilinearForm", "asm", "solve", "condense", "enforce", "penalize"}
"""Names at the top of skfem that make or solve equations; they belong to solve, as skfem.assembly does."""

OPTIONAL = {"distributed", "pyarrow", "pypardiso"}
DEFERRED_ONLY_IN = (
    "cad.kernel",
    "pipeline.cli",
    "pipeline.commands",
    "pipeline.modeller.modeller",
    "pipeline.modeller.serving",
    "pipeline.modeller.tasks",
    "pipeline.check.limited_check",
    "pipeline.study.levels.direct_solve",
    "pipeline.uncertainty.print_scatter",
)
COMPUTED = "<a name computed at run time>"
STAND_INS = ("cad.kernel", COMPUTED)
"""The one module that may import by computed names: what its stand-ins are for."""
VAGUE = {"utils", "util", "common", "helpers", "helper", "core", "base", "misc"}

Rule = Callable[[Path], list[str]]


@dataclass(frozen=True, kw_only=True)
class Import:
    """One imported name, where it stands, and whether it waits for a function to be called or is for types only."""

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
    return [
        item
        for module, path in sources(root).items()
        for item in _imports_of(module, path.read_text(encoding="utf-8"), package=path.name == "__init__.py")
    ]


@functools.cache
def _imports_of(module: str, text: str, *, package: bool) -> tuple[Import, ...]:
    """Return the imports of a source text; eight rules ask for those of the same files."""
    within = module if package else module.rpartition(".")[0]
    return tuple(
        Import(module=module, target=target, line=node.lineno, deferred=deferred)
        for node, deferred in _walk(ast.parse(text), deferred=False)
        for target in _targets(node, within)
        if (module, target) != STAND_INS
    )


def _walk(node: ast.AST, *, deferred: bool) -> Iterator[tuple[ast.AST, bool]]:
    for child in ast.iter_child_nodes(node):
        yield child, deferred
        inside = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda) or _is_for_types(child)
        yield from _walk(child, deferred=deferred or inside)


def _is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


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
            return [str(name.value) if isinstance(name, ast.Constant) else COMPUTED]
    return []


def _home(target: str, known: Mapping[str, object]) -> str | None:
    """Return the longest dotted start of a target that is known."""
    parts = target.split(".")
    starts = (".".join(parts[:count]) for count in range(len(parts), 0, -1))
    return next((start for start in starts if start in known), None)


def _standard(item: Import) -> bool:
    return item.top in sys.stdlib_module_names


def _room(module: str) -> str:
    """Return the room that a module lies in: the longest name of the table that begins its own."""
    return _home(module, MAY_SEE) or module


def _inside(target: str, rooms: Iterable[str]) -> bool:
    return any(target == room or target.startswith(f"{room}.") for room in rooms)


def imports_against_the_order(root: Path) -> list[str]:
    """Fault every import of another room that the importing room may not see, and every module without a room."""
    modules = sources(root)
    found = [f"{module}: give it a room in MAY_SEE" for module in modules if _lost(module)]
    for i in imports(root):
        if i.top not in PACKAGES or _lost(i.module) or i.module in PACKAGES:
            continue
        room = _room(i.module)
        home = _home(i.target, modules) or i.target
        if not _inside(i.target, (room, *MAY_SEE[room])) and not _inside(home, MAY_SEE[room]):
            found.append(str(i))
    return found


def _lost(module: str) -> bool:
    return module not in PACKAGES and _home(module, MAY_SEE) is None


def crowded_folders(root: Path) -> list[str]:
    """Fault every folder of the four packages with more files than one takes in at a glance."""
    count: Counter[Path] = Counter()
    for path in sources(root).values():
        if path.name != "__init__.py":
            count[path.parent] += 1
    return [f"{folder.relative_to(root)}: {n} files" for folder, n in count.items() if n > MOST_FILES]


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
        if (i.deferred and not _may_wait(i.module) and i.top not in OPTIONAL) or i.target.startswith("<")
    ]


def _may_wait(module: str) -> bool:
    return module == "pipeline" or _inside(module, DEFERRED_ONLY_IN)


def optional_imports_that_do_not_wait(root: Path) -> list[str]:
    """Fault every import of an optional package at the top of a module: it would break where it is not installed."""
    return [str(i) for i in imports(root) if i.top in OPTIONAL and not i.deferred]


def heavy_light_rooms(root: Path) -> list[str]:
    """Fault every import of a light room beyond the standard library and light rooms; packages import nothing heavy."""
    return [
        str(i)
        for i in imports(root)
        if (_inside(i.module, LIGHT) or i.module in PACKAGES)
        and not (i.deferred and i.module in PACKAGES)
        and not _standard(i)
        and not _inside(i.target, LIGHT)
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


def imports_past_the_package(root: Path) -> list[str]:
    """Fault every import of the module pipeline.run: the package gives the function `run`, which that would hide."""
    return [str(i) for i in imports(root) if i.module != "pipeline" and i.target.startswith("pipeline.run.")]


def vague_names(root: Path) -> list[str]:
    """Fault every file or folder whose name says nothing about what it holds."""
    folders = [root / folder for folder in (*PACKAGES, "tests")]
    paths = [path for folder in folders for path in (folder, *folder.rglob("*"))]
    return [str(path) for path in paths if path.suffix in ("", ".py") and path.stem in VAGUE]


def init_files_in_tests(root: Path) -> list[str]:
    """Fault `tests/cad/__init__.py` and the like: they would hide the package of that name."""
    return [str(path) for path in (root / "tests").rglob("__init__.py")]


PLANTED: list[tuple[Rule, dict[str, str], str]] = [
    (imports_against_the_order, {"cad/parts/part.py": "import mesh.volume"}, "cad.parts.part:1 imports mesh.volume"),
    (imports_against_the_order, {"mesh/volume.py": "from solve import linear"}, "mesh.volume:1 imports solve.linear"),
    (imports_against_the_order, {"solve/linear.py": "from mesh.volume import Mesh"}, "imports mesh.volume.Mesh"),
    (imports_against_the_order, {"solve/linear.py": "def f():\n    import pipeline.cli"}, ":2 imports pipeline.cli"),
    (imports_against_the_order, {"cad/parts/part.py": "from ...mesh import volume"}, "cad.parts.part:1 imports"),
    (imports_against_the_order, {"cad/theory/a.py": "from cad.design.b import c"}, "imports cad.design.b.c"),
    (imports_against_the_order, {"cad/files/a.py": "from cad.checks.b import c"}, "imports cad.checks.b.c"),
    (imports_against_the_order, {"solve/fruit/a.py": "import solve.contact.scene"}, "imports solve.contact.scene"),
    (imports_against_the_order, {"solve/housing/a.py": "import solve.fruit.split"}, "imports solve.fruit.split"),
    (imports_against_the_order, {"solve/linear.py": "from cad.parts import part"}, "imports cad.parts.part"),
    (imports_against_the_order, {"solve/linear.py": "import cad"}, "imports cad"),
    (imports_against_the_order, {"pipeline/stages/a.py": "import pipeline.report.tables"}, "pipeline.report.tables"),
    (imports_against_the_order, {"pipeline/bench/a.py": "from pipeline import run"}, "imports pipeline.run"),
    (imports_against_the_order, {"pipeline/bench/a.py": "import pipeline.result"}, "imports pipeline.result"),
    (imports_against_the_order, {"pipeline/commands/a.py": "import pipeline.cli"}, "imports pipeline.cli"),
    (
        imports_against_the_order,
        {"pipeline/stages/a.py": "import pipeline.bench.table"},
        "imports pipeline.bench.table",
    ),
    (imports_against_the_order, {"cad/cellar/a.py": ""}, "cad.cellar.a: give it a room"),
    (crowded_folders, {f"cad/parts/part_{n}.py": "" for n in range(13)}, "cad/parts: 13 files"),
    (third_party_outside_its_owner, {"solve/linear.py": "import gmsh"}, "imports gmsh: belongs to mesh"),
    (third_party_outside_its_owner, {"mesh/volume.py": "import cadquery as cq"}, "cadquery: belongs to cad"),
    (third_party_outside_its_owner, {"mesh/a.py": "from scipy.sparse.linalg import splu"}, "splu: belongs to solve"),
    (third_party_outside_its_owner, {"mesh/a.py": "from scipy import sparse"}, "sparse: belongs to solve"),
    (third_party_outside_its_owner, {"mesh/a.py": "from skfem import MeshTet, BilinearForm"}, "Form: belongs to solve"),
    (third_party_outside_its_owner, {"mesh/a.py": "import skfem.helpers"}, "helpers: belongs to solve"),
    (third_party_outside_its_owner, {"cad/part.py": "import pyvista"}, "pyvista: belongs to pipeline"),
    (third_party_outside_its_owner, {"cad/part.py": "import unheard_of"}, "unheard_of: give it an owner"),
    (deferred_imports, {"cad/part.py": "def f():\n    import cadquery"}, "cad.part:2 imports cadquery"),
    (
        deferred_imports,
        {"pipeline/a.py": "class A:\n    def f(self):\n        import gmsh"},
        "pipeline.a:3 imports gmsh",
    ),
    (deferred_imports, {"cad/part.py": "if TYPE_CHECKING:\n    import cadquery"}, "cad.part:2 imports cadquery"),
    (deferred_imports, {"cad/part.py": "def f():\n    return import_module('json')"}, "cad.part:2 imports json"),
    (deferred_imports, {"pipeline/cli.py": "import importlib\nimportlib.import_module(x)"}, "computed at run time"),
    (optional_imports_that_do_not_wait, {"solve/linear.py": "import pypardiso"}, "imports pypardiso"),
    (heavy_light_rooms, {"cad/theory/law.py": "import numpy as np"}, "cad.theory.law:1 imports numpy"),
    (heavy_light_rooms, {"cad/design/a.py": "from cad.parts.part import Part"}, "imports cad.parts.part"),
    (heavy_light_rooms, {"cad/__init__.py": "from cad.parts.part import Part"}, "cad:1 imports cad.parts.part"),
    (import_cycles, {"cad/a.py": "import cad.b", "cad/b.py": "from cad.a import x"}, "cad.a"),
    (import_cycles, {"cad/a.py": "def f():\n    import cad.b", "cad/b.py": "from cad import a"}, "cad.a"),
    (imports_past_the_package, {"pipeline/commands/a.py": "from pipeline.run import run"}, "imports pipeline.run.run"),
    (vague_names, {"cad/utils.py": ""}, "utils.py"),
    (vague_names, {"tests/helpers/data.txt": ""}, "helpers"),
    (init_files_in_tests, {"tests/cad/__init__.py": ""}, "__init__.py"),
]
STILL: set[str] = set()
"""What the moves have left against the rules; each of the next commits takes some away, none may come."""

RULES = sorted({rule for rule, _, _ in PLANTED}, key=lambda rule: rule.__name__)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_repository_keeps_the_rule(rule: Rule) -> None:
    assert {re.sub(r":\d+ ", " ", fault) for fault in rule(ROOT)} - STILL == set()


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
    root = plant(
        {"pipeline/commands/a.py": "def f():\n    from pipeline import run\n", "pipeline/result.py": "import gmsh"}
    )
    assert deferred_imports(root) == []
    assert imports_against_the_order(root) == []
