"""The server of `pipeline view --serve`: one address with a random token, until a signal ends it."""

import asyncio
import os
import secrets
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cad.quantity import validation_error
from pipeline.report.stored import read_report
from pipeline.view.pictures import draw_without_display
from pipeline.view.serving.application import Application
from pipeline.view.serving.guard import TOKEN, Guard, guarding

LOCAL = "127.0.0.1"
_LARGEST_PORT = 65535


def serve(folder: Path, host: str = LOCAL, port: int = 0) -> None:
    """Serve the scenes of an output folder on one address, print it with its token, and wait for a signal.

    Port 0 takes a free one. Raises InputError where the folder has no housing or the address cannot be listened to,
    SolveError.
    """
    report = read_report(folder)
    draw_without_display()
    guard = Guard(token=secrets.token_urlsafe(), host=host, port=_free_port(host, port))
    application = Application(report, folder, f"twintip-{guard.port}")
    application.server.controller.on_server_bind.add(lambda server: server.app.middlewares.append(guarding(guard)))
    application.server.controller.on_server_ready.add(lambda **_: _announce(guard))
    os.environ["WSLINK_READY_MSG"] = ""  # else it prints one
    with _no_arguments():
        asyncio.run(_until_signal(application.server, guard))


def _announce(guard: Guard) -> None:
    """Print the address, once it is listened to."""
    shown = f"[{guard.host}]" if ":" in guard.host else guard.host
    print(f"http://{shown}:{guard.port}/index.html?{TOKEN}={guard.token}", flush=True)
    print("only who has this address sees it; Ctrl-C ends it", file=sys.stderr, flush=True)


async def _until_signal(server: Any, guard: Guard) -> None:  # noqa: ANN401 - of trame
    await server.start(
        host=guard.host,
        port=guard.port,
        exec_mode="coroutine",
        open_browser=False,
        show_connection_info=False,
        disable_logging=True,
        timeout=0,
        thread=True,  # signals are the command's own
    )


def _free_port(host: str, port: int) -> int:
    """Return the port if it can be listened to, a free one for 0; raises InputError."""
    if not 0 <= port <= _LARGEST_PORT:
        raise validation_error("--port", port, "", f"0 to {_LARGEST_PORT}", "0, or none given, takes a free one")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family) as listening:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listening.bind((host, port))
            return int(listening.getsockname()[1])
    except (OSError, UnicodeError, TypeError) as error:  # the last two where a name cannot be one of a host
        reason = error.strerror if isinstance(error, OSError) else "no name that a host can have"
        bound = f"an address of this machine and a port that is free ({reason})"
        raise validation_error("--host, --port", f"{host}:{port}", "", bound, "name another") from error


@contextmanager
def _no_arguments() -> Iterator[None]:
    """Hide the words of the command line: trame reads flags of its own from them."""
    before, sys.argv = sys.argv, sys.argv[:1]
    try:
        yield
    finally:
        sys.argv = before
