"""The process that models: its answers, the errors that cross, its loss, and the same work without it."""

import errno
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import ModuleType

import pytest

from cad.files.export_error import ExportError
from mesh.session import MeshError
from pipeline.storage.modeller import modeller as module
from pipeline.storage.modeller.modeller import Modeller, ModellerLostError, ModellerProcess

ROOT = Path(__file__).parents[4]
MOST_SECONDS = 120.0
LIGHT_TASKS = """
def double(number): return 2 * number
def number(): return os.getpid()
def fail(error): raise error
def kill(signal): os.kill(os.getpid(), signal)
class Strange(Exception): pass
def stumble(parent):
    if os.getpid() != parent: raise Strange("which nobody knows")
    return "done here"
def talk(): print("nothing of this"); os.write(1, b"nor of that"); os.write(2, b"is heard")
def sleep(): time.sleep(600)
def get_ready(): pass
TASKS = {one.__name__: one for one in (double, number, fail, kill, stumble, talk, sleep)}
"""
"""Tasks that load no kernel, in the place of those that model."""


def light_tasks():
    tasks = ModuleType("pipeline.storage.modeller.tasks")
    exec(f"import os, time\n{LIGHT_TASKS}", vars(tasks))
    return tasks


@pytest.fixture
def light(monkeypatch):
    """Let the tasks be light ones, here and in the process."""
    monkeypatch.setitem(sys.modules, "pipeline.storage.modeller.tasks", light_tasks())
    plant = (
        "import os, sys, time, types; tasks = types.ModuleType('pipeline.storage.modeller.tasks'); "
        f"exec({'import os, time' + LIGHT_TASKS!r}, vars(tasks)); sys.modules[tasks.__name__] = tasks; "
    )
    monkeypatch.setattr(module, "_PROGRAM", plant + module._PROGRAM)
    monkeypatch.setattr(module.os, "sched_getaffinity", lambda _: {0, 1})


def is_alive(number):
    """Say whether a process runs: one that has ended and is waited for by nobody does not."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def wait_for_end(number):
    until = time.monotonic() + MOST_SECONDS
    while is_alive(number):
        assert time.monotonic() < until
        time.sleep(0.02)


@pytest.mark.usefixtures("light")
def test_answers_come_from_another_process_in_any_order_and_end_with_the_block(capfd):
    with ModellerProcess() as modeller:
        first, talk, second = modeller.ask("double", 21), modeller.ask("talk"), modeller.ask("number")
        process = second.result()
        assert (first.result(), first.result(), talk.result()) == (42, 42, None)
        assert process != os.getpid()
        assert is_alive(process)
        assert 0.0 <= modeller.cpu_seconds < 1.0
    assert not is_alive(process)
    assert capfd.readouterr() == ("", "")


@pytest.mark.usefixtures("light")
@pytest.mark.parametrize(
    "error",
    [
        ExportError("housing.step: volume read back = 1: must be 2"),
        MeshError("compare", "volume = 1 mm^3: must be 2 mm^3", "mesh the very housing"),
        OSError(errno.ENOSPC, "No space left on device", "out/housing.step"),
        KeyError("a bug"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_error_in_the_process_is_the_same_error_here(error):
    with ModellerProcess() as modeller:
        answer, after = modeller.ask("fail", error), modeller.ask("double", 1)
        with pytest.raises(type(error)) as found:
            answer.result()
        assert after.result() == 2
    assert str(found.value) == str(error)
    for name in ("errno", "filename", "stage", "remedy"):
        assert getattr(found.value, name, None) == getattr(error, name, None)
    assert any("in fail" in note for note in found.value.__notes__)


@pytest.mark.usefixtures("light")
@pytest.mark.parametrize(
    ("by", "remedy"), [(signal.SIGKILL, "free .* memory, then run again"), (signal.SIGSEGV, "run again")]
)
def test_process_that_is_killed_is_one_line_with_its_end(by, remedy):
    with ModellerProcess() as modeller:
        answer = modeller.ask("kill", by)
        with pytest.raises(ModellerLostError, match=rf"^kill: the process .* by signal {by.name}; must .*; {remedy}$"):
            answer.result()
        with pytest.raises(ModellerLostError, match=by.name):
            modeller.ask("double", 1).result()


@pytest.mark.usefixtures("light")
def test_task_that_meets_what_the_process_cannot_send_is_done_here():
    with ModellerProcess() as modeller:
        answer, after = modeller.ask("stumble", os.getpid()), modeller.ask("double", 1)
        assert (answer.result(), after.result()) == ("done here", 2)


@pytest.mark.usefixtures("light")
def test_process_outlives_the_thread_that_starts_it():
    with ModellerProcess() as modeller:
        thread = threading.Thread(target=modeller.start)
        thread.start()
        thread.join(MOST_SECONDS)
        assert modeller.ask("number").result() != os.getpid()


@pytest.mark.usefixtures("light")
def test_closed_standard_streams_are_no_part_of_the_link(monkeypatch):
    """Ends that the system gave the numbers of streams are moved beyond them."""
    low = [os.dup(0) for _ in range(2)]
    monkeypatch.setattr(module, "_STREAMS", max(low) + 1)
    for number in low:
        os.close(number)
    ours, theirs = module._link()
    with ours, theirs:
        assert min(ours.fileno(), theirs.fileno()) > max(low)
    with ModellerProcess() as modeller:
        assert modeller.ask("double", 1).result() == 2


@pytest.mark.usefixtures("light")
def test_block_that_is_left_by_an_error_ends_the_process_in_the_midst_of_a_task():
    seen = []

    def interrupted():
        with ModellerProcess() as modeller:
            seen.append(modeller.ask("number").result())
            modeller.ask("sleep")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not is_alive(seen[0])


@pytest.mark.usefixtures("light")
def test_one_core_or_a_machine_that_starts_no_process_works_here(monkeypatch):
    def none(*_, **__):
        raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")

    with monkeypatch.context() as patch:
        patch.setattr(module.subprocess, "Popen", none)
        with ModellerProcess() as modeller:
            assert modeller.ask("number").result() == os.getpid()
    with monkeypatch.context() as patch:
        patch.setattr(module.os, "sched_getaffinity", lambda _: {0})
        patch.setattr(module.subprocess, "Popen", lambda *_, **__: pytest.fail("started"))
        with ModellerProcess() as modeller:
            modeller.start()
            assert modeller.ask("number").result() == os.getpid()
    with monkeypatch.context() as patch:  # another program that has Python in it
        patch.setattr(module.sys, "executable", "/opt/cad/program")
        patch.setattr(module.subprocess, "Popen", lambda *_, **__: pytest.fail("started"))
        with ModellerProcess() as modeller:
            assert modeller.ask("number").result() == os.getpid()


def test_work_in_this_process_is_done_when_its_answer_is_waited_for(monkeypatch):
    monkeypatch.setitem(sys.modules, "pipeline.storage.modeller.tasks", light_tasks())
    modeller = Modeller()
    answer = modeller.ask("fail", ExportError("a file"))
    with pytest.raises(ExportError, match="a file"):
        answer.result()
    assert modeller.ask("number").result() == os.getpid()
    assert modeller.cpu_seconds == 0.0


@pytest.mark.usefixtures("light")
def test_process_ends_with_a_parent_that_is_killed_in_a_script_without_a_guard(tmp_path):
    """The user's script is not run again: it has no `if __name__ == "__main__"`."""
    script = tmp_path / "script.py"
    script.write_text(
        "from pipeline.storage.modeller import modeller as module\n"
        "module.os.sched_getaffinity = lambda _: {0, 1}\n"
        f"module._PROGRAM = {module._PROGRAM!r}\n"
        "modeller = module.ModellerProcess()\n"
        "print(modeller.ask('number').result(), flush=True)\n"
        "modeller.ask('sleep').result()\n"
    )
    variables = {**os.environ, "PYTHONPATH": str(ROOT)}
    parent = subprocess.Popen([sys.executable, script], cwd=ROOT, env=variables, stdout=subprocess.PIPE)
    try:
        child = int(parent.stdout.readline())
        assert is_alive(child)
    finally:
        parent.kill()
        parent.communicate(timeout=MOST_SECONDS)
    wait_for_end(child)
