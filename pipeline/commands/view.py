"""`pipeline view`: an output folder to look at, in a window, as pictures, as a web page, or served to a browser."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from cad.quantity import validation_error
from pipeline.commands.console import add_force_flag
from pipeline.storage.interruption import interruptible

PURPOSE = "show the parts, fields and response"
EXAMPLE = "pipeline view outputs/paper --png pictures"


def add_arguments(parser: ArgumentParser) -> None:
    """Add DIR, the flags that name what is written, and those of the server."""
    parser.add_argument("folder", metavar="DIR", type=Path, help="an output folder")
    add = parser.add_argument
    add("--png", metavar="DIR", type=Path, help="write pictures there instead of opening a window")
    add("--html", metavar="FILE", type=Path, help="write the scenes as one web page that needs no network")
    add("--pvd", metavar="DIR", type=Path, help="write flexures and fruit over the travel there, a series for ParaView")
    add("--inp", metavar="DIR", type=Path, help="write the scenes there as decks that CalculiX runs as they are")
    add_force_flag(parser)
    add(
        "--serve", action="store_true", help="serve the scenes to a browser on this machine, with sliders, until Ctrl-C"
    )
    add(
        "--host", metavar="ADDRESS", help="with --serve: listen to this address (default 127.0.0.1, this machine alone)"
    )
    add("--port", metavar="N", type=int, help="with --serve: the port (default: a free one)")


def execute(arguments: Namespace) -> int:
    """Show an output folder in a window, or write what the flags ask for and print the paths; return exit code 0."""
    if arguments.serve:
        return _served(arguments)
    _refuse_without_server(arguments)
    if not _asked_to_write(arguments):
        from pipeline.view.pictures import pictures
        from pipeline.view.window import show_pictures

        show_pictures(pictures(arguments.folder), arguments.folder.name)
        return 0
    with interruptible():
        paths = _written(arguments)
    for path in paths:
        print(path)
    return 0


def _served(arguments: Namespace) -> int:
    """Serve an output folder until a signal ends it."""
    if _asked_to_write(arguments):
        raise validation_error(
            "--serve", "given with another flag", "", "alone", "write files with a command of their own"
        )
    from pipeline.view.serving.server import LOCAL, serve

    with interruptible():
        serve(arguments.folder, arguments.host or LOCAL, arguments.port or 0)
    return 0


def _refuse_without_server(arguments: Namespace) -> None:
    for flag, value in (("--host", arguments.host), ("--port", arguments.port)):
        if value is not None:
            raise validation_error(flag, value, "", "given with --serve", "add --serve, or leave it out")


def _asked_to_write(arguments: Namespace) -> bool:
    return any(path is not None for path in (arguments.png, arguments.html, arguments.pvd, arguments.inp))


def _written(arguments: Namespace) -> list[Path]:
    """Write what the flags ask for; return the paths."""
    paths: list[Path] = []
    if arguments.png is not None:
        from pipeline.view.pictures import pictures, write_pictures

        paths += write_pictures(pictures(arguments.folder), arguments.png, force=arguments.force)
    if arguments.html is not None:
        from pipeline.view.web_page import write_web_page

        paths.append(write_web_page(arguments.folder, arguments.html, force=arguments.force))
    if arguments.pvd is not None:
        from pipeline.view.series import write_series

        paths += write_series(arguments.folder, arguments.pvd, force=arguments.force)
    if arguments.inp is not None:
        from pipeline.view.calculix_decks import write_decks

        paths += write_decks(arguments.folder, arguments.inp, force=arguments.force)
    return paths
