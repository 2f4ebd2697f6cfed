"""The docstring of each public name: its form, what it says of the signature and of errors, and its example."""

import dataclasses
import doctest
import inspect
import re
import shutil
from concurrent.futures import BrokenExecutor
from pathlib import Path

import cadquery as cq
import pytest
from marks import cases_by_time
from stand_ins import relaxing_result, result_of

import twintip
from cad.files.export_error import ExportError
from docs.docstrings import GROUPS, SECTIONS, docstring, signature
from mesh.session import MeshError
from pipeline import main_job
from pipeline.report.of_result import report_of_result
from pipeline.report.outputs import write_outputs
from sensor.quantity import STANDARD_GRAVITY
from solve.solve_error import SolveError

ROOT = Path(__file__).parents[2]
FUNCTIONS = [name for name in twintip.__all__ if inspect.isfunction(getattr(twintip, name))]
SLOW = {"modulus", "CompressionResult"}  # a fruit is solved
SLOW |= {"run_study"}  # processes are started
STUDIES = {"process_engine", "StudySummary"}  # the same study once more
STUDY = """
base = "paper"
how = "grid"
wanted = ["springs.K_l_N_per_m"]
[vary]
"targets.P_max" = [4, 5, 6, 7]
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Return a folder with the files that examples name: a run of a pair, a press, weights, a test and a study."""
    folder = tmp_path_factory.mktemp("files")
    out = folder / "outputs" / "mine"
    out.mkdir(parents=True)
    write_outputs(result_of(), out)
    page = (ROOT / "docs" / "read-a-fruit.md").read_text(encoding="utf-8")
    table = re.search(r"^    t_s,x_mm,F_l_N,F_h_N\n(?:    .+\n)+", page, flags=re.MULTILINE)
    assert table is not None
    (folder / "press.csv").write_text(re.sub(r"^    ", "", table[0], flags=re.MULTILINE), encoding="utf-8")
    rows = ["tip,weight_g,deflection_mm"]
    for tip, K in (("low", 1.0), ("high", 22.0)):
        rows += [f"{tip},{grams},{1e-3 * STANDARD_GRAVITY * grams / K}" for grams in (0, 20, 50, 100)]
    (folder / "weights.csv").write_text("\n".join(rows), encoding="utf-8")
    (folder / "springs.toml").write_text(STUDY, encoding="utf-8")
    shutil.copy(ROOT / "docs" / "examples" / "fruit-1.csv", folder)
    return folder


@pytest.fixture
def folder(files, tmp_path, monkeypatch):
    """Work in a copy of that folder."""
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)


def complaints(name):
    """Return what differs from the docstring where the examples of a name are run, and how many there are."""
    example = doctest.DocTestParser().get_doctest(
        inspect.getdoc(getattr(twintip, name)) or "", {"twintip": twintip, "Path": Path}, name, None, None
    )
    told = []
    doctest.DocTestRunner(verbose=False).run(example, out=told.append)
    return told, len(example.examples)


def entry_names(parts, title):
    """Return the names in a section of a docstring; an entry may have several."""
    return [name for entry in parts.sections.get(title, ()) for name in entry.name.split(", ")]


def test_groups_of_the_page_have_every_public_name_once():
    assert sorted(name for names in GROUPS.values() for name in names) == twintip.__all__


@pytest.mark.parametrize("name", twintip.__all__)
def test_docstring_is_a_line_and_sections_in_the_order_of_numpydoc(name):
    parts = docstring(name)
    titles = re.findall(r"^(.+)\n-+$", inspect.getdoc(getattr(twintip, name)), flags=re.MULTILINE)
    assert titles == [title for title in SECTIONS if title in titles]
    assert [*parts.sections, "Examples"] == titles
    assert re.fullmatch(r"[A-Z].*[.]", parts.summary)
    assert [entry for entries in parts.sections.values() for entry in entries if not entry.meaning.endswith(".")] == []


@pytest.mark.parametrize("name", [name for name in twintip.__all__ if signature(name)])
def test_docstring_of_what_is_called_has_its_parameters_and_result(name):
    parts = docstring(name)
    called = inspect.signature(getattr(twintip, name))
    assert entry_names(parts, "Parameters") == list(called.parameters)
    optional = {each.name for each in called.parameters.values() if each.default is not inspect.Parameter.empty}
    assert {entry.name for entry in parts.sections["Parameters"] if entry.kind.endswith(", optional")} == optional
    assert all(entry.kind for entry in parts.sections["Parameters"])
    results = {"Returns", "Yields"} & parts.sections.keys()
    assert results == ({"Yields" if name == "process_engine" else "Returns"} if name in FUNCTIONS else set())


@pytest.mark.parametrize("name", sorted({*twintip.__all__} - {*FUNCTIONS} - {"InputError"}))
def test_docstring_of_a_record_has_its_fields_and_units(name):
    """Each attribute is a field or a property, and each field is an attribute or a parameter, or one of its base."""
    kind, parts = getattr(twintip, name), docstring(name)
    named = entry_names(parts, "Attributes") + entry_names(parts, "Parameters")
    own = [item.name for item in dataclasses.fields(kind)]
    assert [each for each in named if each not in own and not hasattr(kind, each)] == []
    assert [each for each in own if each not in named] == []
    scaled = [item for item in dataclasses.fields(kind) if "times" in item.metadata]
    assert [item.name for item in scaled if "attribute_unit" not in item.metadata] == []


def run_into(folder="look"):
    return twintip.run(twintip.load_design("paper"), twintip.RunOptions(out=Path(folder), look=True, tolerance=0.02))


def evaluated_with(**settings):
    return twintip.evaluate(twintip.load_design("paper", settings))


def part_held_at(*held):
    cone = cq.Workplane(cq.Solid.makeCone(5.0, 3.0, 10.0))
    return twintip.stiffness(cone, held=held, pressed={"top": (0, 0, 10)}, E_MPa=2000)


def engine_of(processes):
    with twintip.process_engine(processes) as engine:
        return engine


def unit_with(**changes):
    report = twintip.read_report(MINE)
    return dataclasses.replace(twintip.calibrate(report, "weights.csv").unit, **changes)


MINE = Path("outputs/mine")
BALL = twintip.Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
MESH, SOLVE, EXPORT = MeshError("quality", "a sliver", "check it"), SolveError("no"), ExportError("lost")
FULL, SHORT, LOST = OSError("disk full"), MemoryError(), BrokenExecutor()
STAGES, TETRAHEDRA, LAW = (
    "pipeline.main_job.evaluate_sensor",
    "pipeline.springs.own_part.tetrahedral_mesh",
    "instrument.compress.modulus.solve_force_law",
)
REFUSED = [
    ("load_design", lambda: twintip.load_design("papre")),
    ("Design", lambda: twintip.Design(name="two words")),
    ("RunOptions", lambda: twintip.RunOptions(tolerance=1.0)),
    ("run", lambda: run_into("press.csv")),
    ("evaluate", lambda: evaluated_with(**{"tips.spacing_mm": 200.0})),
    ("housing", lambda: twintip.housing(result_of(made=False))),
    ("cover", lambda: twintip.cover(result_of(made=False))),
    ("mount", lambda: twintip.mount(result_of(made=False))),
    ("assembly", lambda: twintip.assembly(result_of(made=False))),
    ("stiffness", lambda: part_held_at(9, 9, 9)),
    ("read_report", lambda: twintip.read_report(Path("outputs"))),
    ("read_press", lambda: twintip.read_press(twintip.read_report(MINE), "weights.csv")),
    ("calibrate", lambda: twintip.calibrate(twintip.read_report(MINE), "press.csv")),
    ("PrintedUnit", lambda: unit_with(K_N_per_m=(1000.0,))),
    ("c_header", lambda: twintip.c_header(report_of_result(relaxing_result()))),
    ("micropython", lambda: twintip.micropython(report_of_result(relaxing_result()))),
    ("read_study", lambda: twintip.read_study(Path("study.toml"))),
    ("Study", lambda: dataclasses.replace(twintip.read_study(Path("springs.toml")), wanted=())),
    ("process_engine", lambda: engine_of(0)),
    ("run_study", lambda: twintip.run_study(twintip.read_study(Path("springs.toml")), Path("press.csv"), None)),
    ("modulus", lambda: twintip.modulus("springs.toml", twintip.TestGeometry(body=BALL))),
    ("TestGeometry", lambda: twintip.TestGeometry(body=BALL, poisson=0.6)),
    ("Ellipsoid", lambda: twintip.Ellipsoid(height_mm=70.0, radius_mm=0.0, radius_across_mm=35.0)),
    ("CylinderOnSide", lambda: twintip.CylinderOnSide(radius_mm=0.0, length_mm=30.0)),
    ("CylinderOnEnd", lambda: twintip.CylinderOnEnd(height_mm=10.0, radius_mm=0.0)),
    ("RectangularBlock", lambda: twintip.RectangularBlock(height_mm=10.0, width_mm=0.0, length_mm=20.0)),
    ("Plunger", lambda: twintip.Plunger(radius_mm=0.0)),
]
"""What raises InputError."""
NOT_POSSIBLE = [
    ("size_springs", lambda: twintip.size_springs(P_max=0.5, NL=0.05, K_m_max=4.629)),
    ("Springs", lambda: twintip.Springs(K_l=0.0, K_h=17.3)),
    ("force_ratio", lambda: twintip.force_ratio(twintip.Springs(K_l=1.0, K_h=20.0), K_m=0.0)),
    ("fruit_stiffness", lambda: twintip.fruit_stiffness(twintip.Springs(K_l=1.0, K_h=20.0), P=21.0)),
]
"""What raises ValueError."""
FAULTS = [
    *(("run", error, STAGES, run_into) for error in (MESH, SOLVE, EXPORT, FULL, SHORT, LOST)),
    *(("evaluate", error, STAGES, evaluated_with) for error in (MESH, SOLVE, FULL, SHORT)),
    *(("stiffness", error, TETRAHEDRA, lambda: part_held_at(0, 0, 0)) for error in (MESH, SOLVE)),
    ("modulus", SOLVE, LAW, lambda: twintip.modulus("fruit-1.csv", twintip.TestGeometry(body=BALL))),
]
"""What passes on an error, with the function that raises it."""


def raise_it(error):
    raise error


def test_errors_of_docstrings_are_those_that_are_raised():
    named = {(name, error) for name in twintip.__all__ for error in entry_names(docstring(name), "Raises")}
    raised = {(name, "InputError") for name, _ in REFUSED} | {(name, "ValueError") for name, _ in NOT_POSSIBLE}
    assert named == raised | {(name, type(error).__name__) for name, error, *_ in FAULTS}


@pytest.mark.parametrize("call", [pytest.param(call, id=name) for name, call in REFUSED])
@pytest.mark.usefixtures("folder")
def test_input_error_of_a_docstring_is_raised(call):
    with pytest.raises(twintip.InputError):
        call()


@pytest.mark.parametrize("call", [pytest.param(call, id=name) for name, call in NOT_POSSIBLE])
def test_value_error_of_a_docstring_is_raised(call):
    with pytest.raises(ValueError, match="must be"):
        call()


@pytest.mark.parametrize(
    ("error", "place", "call"),
    [pytest.param(error, *others, id=f"{name} {type(error).__name__}") for name, error, *others in FAULTS],
)
@pytest.mark.usefixtures("folder")
def test_fault_of_a_docstring_is_raised_and_leaves_no_folder(error, place, call, monkeypatch):
    before = sorted(Path().iterdir())
    monkeypatch.setattr(place, lambda *_: raise_it(error))
    with pytest.raises(type(error)):
        call()
    assert sorted(Path().iterdir()) == before


@pytest.mark.parametrize("name", cases_by_time(twintip.__all__, slow=SLOW, studies=STUDIES))
@pytest.mark.usefixtures("folder", "without_page")
def test_example_of_a_docstring_runs(name, monkeypatch):
    """On stand-ins of a solved sensor: what is solved is tested elsewhere."""
    monkeypatch.setattr(main_job, "evaluate_sensor", lambda _: result_of())
    told, count = complaints(name)
    assert count
    assert told == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["run", "evaluate", "assembly"])
@pytest.mark.usefixtures("folder")
def test_example_of_a_docstring_runs_where_all_is_solved(name):
    assert complaints(name)[0] == []


def test_wrong_number_in_an_example_is_told(monkeypatch):
    text = twintip.force_ratio.__doc__
    monkeypatch.setattr(twintip.force_ratio, "__doc__", text.replace("2.927", "2.928"))
    assert complaints("force_ratio")[0] != []
