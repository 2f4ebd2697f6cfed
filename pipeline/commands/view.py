"""`pipeline view`: an output folder to look at, in a window, as pictures, as a web page, or served to a browser."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

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
    add_force_flag(parser)


def execute(arguments: Namespace) -> int:
    """Show an output folder in a window, or write what the flags ask for and print the paths; return exit code 0."""
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


def _asked_to_write(arguments: Namespace) -> bool:
    return any(path is not None for path in (arguments.png, arguments.html))


def _written(arguments: Namespace) -> list[Path]:
    """Write what the flags ask for; return the paths."""
    paths: list[Path] = []
    if arguments.png is not None:
        from pipeline.view.pictures import pictures, write_pictures

        paths += write_pictures(pictures(arguments.folder), arguments.png, force=arguments.force)
    if arguments.html is not None:
        from pipeline.view.web_page import write_web_page

        paths.append(write_web_page(arguments.folder, arguments.html, force=arguments.force))
    return paths
