"""Ctrl-C and SIGTERM end a process at once, and leave nothing behind wherever they arrive."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from deadline import DEADLINE_S
from programs import PYTHON, ended

from mesh.session import gmsh_session
from pipeline.storage import files, folder, interrupts
from pipeline.storage.digests import with_digest
from pipeline.storage.files import write_files
from pipeline.storage.folder import output_folder
from pipeline.storage.interrupts import (
    SIGNALS,
    end_by_signals,
    ending_signal,
    interruptible,
    signals_for_this_thread,
    uninterrupted,
)
from pipeline.storage.workers import cad_worker
from twintip import cli
from twintip.__main__ import main
from twintip.commands.progress import showing_progress

CUT = {module.__file__ for module in (contextlib, files, folder, interrupts)}
ENDED, WHOLE, SWALLOWED = 0, 1, 2


def in_child(work):
    """Return the exit code of a piece of work in a process of its own, which signals end."""
    child = os.fork()
    if child == 0:
        code = 99
        try:
            end_by_signals()
            code = int(work())
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def signalled_at(line, number, work):
    """Return how a piece of work ended that got a signal before a line of these files, counted from its begin."""

    def ended():
        lines = iter(range(line))

        def trace(frame, event, _):
            if frame.f_code.co_filename not in CUT:
                return None
            if event == "line" and next(lines, None) is None:
                sys.settrace(None)
                frame.f_trace = None
                signal.raise_signal(number)
            return trace

        sys.settrace(trace)
        try:
            work()
        except KeyboardInterrupt:
            return ENDED
        finally:
            sys.settrace(None)
        return SWALLOWED if ending_signal() else WHOLE

    return in_child(ended)


def write_folder(place):
    with output_folder(place / "sub" / "out") as made:
        (made / "report.json").write_text(json.dumps(with_digest({"files": []})), encoding="utf-8")


def write_file(place):
    write_files({place / "sub" / "unit.toml": b"new"}, "--out", force=True)


@pytest.mark.parametrize("step", [pytest.param(1, marks=pytest.mark.study), 11])
@pytest.mark.parametrize("write", [write_folder, pytest.param(write_file, marks=pytest.mark.slow)])
@pytest.mark.parametrize("there", [pytest.param(False, marks=pytest.mark.slow), True])
def test_signal_at_any_line_leaves_what_was_there_or_what_is_new(there, write, step, tmp_path):
    """Where a destructor swallows it, the work goes on for less than a second."""
    outcome, line, ended = ENDED, 0, 0
    while outcome != WHOLE:
        place = tmp_path / str(line)
        place.mkdir()
        if there:
            write(place)
            for mine in place.rglob("unit.toml"):
                mine.write_bytes(b"mine")
        outcome = signalled_at(line, SIGNALS[line % 2], lambda place=place: write(place))
        assert outcome in (ENDED, WHOLE, SWALLOWED), f"line {line}"
        ended += outcome == ENDED
        names = {path.name for path in place.rglob("*")}
        assert names <= {"sub", "out", "report.json", "unit.toml", "unit.toml.bak"}, f"line {line}"
        assert not there or names & {"report.json", "unit.toml"}, f"line {line}"
        line += step
    assert ended > 10


@pytest.mark.parametrize(
    "block",
    [
        lambda place: output_folder(place / "out"),
        lambda _: output_folder(None),
        lambda _: cad_worker(),
        lambda _: showing_progress("a run"),
    ],
    ids=["folder", "no folder", "worker", "progress"],
)
def test_signal_ends_the_work_of_a_run_at_once(block, tmp_path):
    def work():
        late = False
        try:
            with block(tmp_path):
                signal.raise_signal(signal.SIGTERM)
                late = True
        except KeyboardInterrupt:
            return late
        return 2

    assert in_child(work) == 0
    assert list(tmp_path.iterdir()) == []


def test_signal_waits_for_the_end_of_a_block_that_must_not_be_cut_and_no_longer():
    def work():
        done = []
        try:
            with uninterrupted():
                signal.raise_signal(signal.SIGTERM)
                signal.raise_signal(signal.SIGINT)
                done.append("held")
                with interruptible():
                    done.append("cut")
        except KeyboardInterrupt:
            return 0 if (done, ending_signal()) == (["held"], signal.SIGTERM) else 1
        return 2

    assert in_child(work) == 0


def test_signal_that_a_library_swallows_comes_again():
    def work():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            time.sleep(1.5)  # on its way through the blocks that clear up, it is left alone
        start = time.monotonic()
        try:
            while time.monotonic() < start + DEADLINE_S:
                time.sleep(0.01)
        except KeyboardInterrupt:
            return 0
        return 1

    assert in_child(work) == 0


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize(("is_early", "code"), [(False, 1), (True, 128)])
def test_signal_after_the_answer_or_while_a_command_clears_up_changes_no_exit_code(is_early, code, number, monkeypatch):
    def command():
        if is_early:
            signal.raise_signal(number)
        return 1

    def work():
        ended = main()
        for late in (*SIGNALS, signal.SIGALRM):
            signal.raise_signal(late)
        return ended

    monkeypatch.setattr(cli, "main", command)
    assert in_child(work) == code + is_early * number


def test_signals_that_are_masked_stay_masked_behind_the_start_of_a_thread():
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
    try:
        with signals_for_this_thread():
            assert signal.pthread_sigmask(signal.SIG_BLOCK, []) >= set(SIGNALS)
        assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == {*previous_mask, signal.SIGTERM}
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


def test_gmsh_takes_no_signal_while_it_opens():
    """It gives SIGTERM back to the system, which would end the process with nothing cleared away."""

    def work():
        stopped = threading.Event()

        def signals():
            while not stopped.wait(0.0002):
                os.kill(os.getpid(), signal.SIGTERM)

        sender = threading.Thread(target=signals)
        try:
            with uninterrupted():
                with signals_for_this_thread():
                    sender.start()
                for _ in range(20):
                    with gmsh_session():
                        pass
                stopped.set()
                sender.join()
        except KeyboardInterrupt:
            return 0
        return 1

    assert in_child(work) == 0


ANSWER = "from twintip.commands import console\n"
PRINTS_FOR_EVER = f"""{ANSWER}
def run(_):
    while True:
        yield console.Answer(code=0, text="x" * 1000)
"""
LOADS_FOR_EVER = f"""{ANSWER}
def run(_):
    while True:
        try:
            raise ImportError
        except ImportError:
            pass
        except BaseException as error:
            raise ImportError("numpy.core.multiarray failed to import") from error
"""
ENDLESS = {
    "answer": (PRINTS_FOR_EVER, signal.SIGTERM),
    "import": (LOADS_FOR_EVER, signal.SIGINT),
    # As where a dataclass is made: Python would end itself by Ctrl-C once more.
    "text": ("def run(_):\n    exec('while True: pass')\n", signal.SIGINT),
}
PROGRAM = """
import sys, types, twintip.__main__
sys.modules["twintip.commands.doctor"] = types.SimpleNamespace(run=run)
sys.argv[1:] = ["doctor"]
print("ready", file=sys.stderr, flush=True)
sys.exit(twintip.__main__.main())
"""


LEAVES_A_SEMAPHORE = """
from loky.backend import resource_tracker
from sensor.quantity import InputError
def run(_):
    resource_tracker.register("/loky-nobody", "semlock")
    raise InputError("wrong")
"""


def test_wrong_input_is_one_line_though_a_worker_leaves_a_semaphore():
    done = ended(PYTHON, "-c", LEAVES_A_SEMAPHORE + PROGRAM)
    assert (done.returncode, done.stderr) == (2, "ready\npipeline: wrong\n")


@pytest.mark.parametrize(("command", "number"), ENDLESS.values(), ids=ENDLESS)
def test_signal_ends_a_command_whatever_it_is_at(command, number):
    """Also where the reader of the answer takes nothing more."""
    with subprocess.Popen(
        [sys.executable, "-c", command + PROGRAM],
        cwd=Path(__file__).parents[3],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    ) as process:
        assert process.stderr.readline() == "ready\n"
        time.sleep(0.3)  # a loaded machine may be at the start of the command, which has to end as well
        process.send_signal(number)
        assert process.wait(DEADLINE_S) == 128 + number
        assert process.stderr.read() == "pipeline: interrupted\n"
