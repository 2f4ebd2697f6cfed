import os
import signal
import subprocess
import sys
from pathlib import Path

import gmsh
import pytest

from mesh.session import OPTIONS, MeshError, gmsh_session, stage

ROOT = Path(__file__).parents[2]


def test_session_is_open_inside_and_closed_after():
    with gmsh_session():
        assert gmsh.isInitialized()
    assert not gmsh.isInitialized()


def test_session_closes_when_gmsh_raises():
    with pytest.raises(MeshError), gmsh_session():  # noqa: SIM117
        with stage("open", "give a file that exists"):
            gmsh.model.occ.importShapes("no-such-file.brep")
    assert not gmsh.isInitialized()


def test_session_closes_on_a_keyboard_interrupt():
    with pytest.raises(KeyboardInterrupt), gmsh_session():
        os.kill(os.getpid(), signal.SIGINT)
    assert not gmsh.isInitialized()


def test_second_session_inside_the_first_is_refused_and_leaves_it_open():
    with gmsh_session():
        with pytest.raises(MeshError), gmsh_session():
            pass
        assert gmsh.isInitialized()
    assert not gmsh.isInitialized()


def test_wrong_option_name_is_an_error_and_closes(monkeypatch):
    monkeypatch.setitem(OPTIONS, "Mesh.NoSuchOption", 1.0)
    with pytest.raises(MeshError), gmsh_session():
        pass
    assert not gmsh.isInitialized()


def test_stage_tells_where_why_and_what_to_do():
    with pytest.raises(MeshError) as caught, stage("generate", "refine"):
        raise Exception("no elements")  # the bare class is what gmsh raises
    assert (caught.value.stage, caught.value.hint) == ("generate", "refine")
    assert "no elements" in caught.value.reason


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
    done = subprocess.run(words, capture_output=True, encoding="utf-8", check=True, cwd=ROOT, timeout=600)
    assert done.stdout == "reached\n" * 2
