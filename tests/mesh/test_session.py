import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import gmsh
import numpy as np
import pytest
from deadline import DEADLINE_S

from mesh.housing.blocks import element_counts
from mesh.housing.frame import housing_blocks
from mesh.housing.profile import mesh_profile
from mesh.session import OPTIONS, gmsh_session, stage
from reference.small_housing import SMALL_HOUSING
from sensor.machine_error import MachineError

ROOT = Path(__file__).parents[2]
HOUSING_BLOCKS = housing_blocks(SMALL_HOUSING, element_counts(SMALL_HOUSING, 2.0))


def test_session_closes_on_a_keyboard_interrupt():
    with pytest.raises(KeyboardInterrupt), gmsh_session():
        os.kill(os.getpid(), signal.SIGINT)
    assert not gmsh.isInitialized()


@pytest.fixture
def program():
    """Open gmsh as a program of its own does, with a model, a view and options that change every mesh."""
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("Mesh.ElementOrder", 2.0)
    gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 1.0)
    gmsh.option.setNumber("Mesh.MeshSizeFactor", 3.0)
    gmsh.option.setString("General.GraphicsFont", "Courier")
    gmsh.option.setColor("Mesh.Points", 10, 20, 30)
    gmsh.view.add("a view")
    gmsh.model.add("other")
    gmsh.model.add("mine")
    gmsh.model.occ.addBox(0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(2)
    yield
    gmsh.finalize()


def state(folder):
    """Return what a program finds in its session: all options that it has set, models, mesh and views."""
    written_as = gmsh.option.getNumber("Print.Format")
    gmsh.write(str(folder / "state.opt"))
    gmsh.option.setNumber("Print.Format", written_as)
    options = (folder / "state.opt").read_text().splitlines()
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    return (
        [line for line in options if "(read-only)" not in line],  # sizes of a window, and facts about gmsh
        gmsh.model.list(),
        gmsh.model.getCurrent(),
        gmsh.model.getEntities(),
        (tags.tolist(), coordinates.tolist()),
        gmsh.view.getTags().tolist(),
    )


@pytest.mark.usefixtures("program")
@pytest.mark.parametrize("fault", [None, KeyError, Exception, KeyboardInterrupt])
def test_session_beside_that_of_a_program_leaves_it_as_it_was(tmp_path, fault):
    before = state(tmp_path)
    with suppress(KeyError, MachineError, KeyboardInterrupt), gmsh_session(), stage("test", "none"):
        assert (gmsh.model.getEntities(), gmsh.option.getNumber("Mesh.SubdivisionAlgorithm")) == ([], 0.0)
        gmsh.model.geo.addPoint(-9.0, 0.0, 0.0)
        gmsh.model.geo.synchronize()
        if fault is not None:
            raise fault
    assert state(tmp_path) == before
    assert gmsh.isInitialized()


def test_mesh_beside_that_of_a_program_is_the_same_to_the_bit(request):
    alone = mesh_profile(HOUSING_BLOCKS)
    request.getfixturevalue("program")
    beside = mesh_profile(HOUSING_BLOCKS)
    assert np.array_equal(beside.points, alone.points)
    assert np.array_equal(beside.quads, alone.quads)


def test_session_inside_another_has_a_model_of_its_own():
    with gmsh_session():
        gmsh.model.geo.addPoint(0.0, 0.0, 0.0)
        gmsh.model.geo.synchronize()
        with gmsh_session():
            assert gmsh.model.getEntities() == []
        assert gmsh.model.getEntities() == [(0, 1)]
    assert not gmsh.isInitialized()


def test_wrong_option_name_is_an_error_and_closes(monkeypatch):
    monkeypatch.setitem(OPTIONS, "Mesh.NoSuchOption", 1.0)
    with pytest.raises(MachineError), gmsh_session():
        pass
    assert not gmsh.isInitialized()


def test_stage_tells_where_why_and_what_to_do():
    with pytest.raises(MachineError, match=r"'generate'.*no elements.*refine"), stage("generate", "refine"):
        raise Exception("no elements")  # the bare class is what gmsh raises


def test_stage_leaves_errors_of_others_alone():
    with pytest.raises(KeyError), stage("generate", "refine"):
        raise KeyError("mine")


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_signal_reaches_its_handler_after_gmsh_was_open(name):
    """In a process of its own: without the handler the signal ends it."""
    program = f"""if True:
        import os, signal
        from mesh.session import gmsh_session
        signal.signal(signal.{name}, lambda *_: print("reached"))
        with gmsh_session():
            os.kill(os.getpid(), signal.{name})
        os.kill(os.getpid(), signal.{name})
    """
    words = [sys.executable, "-c", program]
    done = subprocess.run(words, capture_output=True, encoding="utf-8", check=True, cwd=ROOT, timeout=DEADLINE_S)
    assert done.stdout == "reached\n" * 2
