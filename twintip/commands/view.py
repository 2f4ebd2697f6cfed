"""`pipeline view`: an output folder to look at, in a window, as pictures or as a web page."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from twintip.commands.console import add_force_flag

PURPOSE = "show the parts, fields and response"
EXAMPLE = "pipeline view outputs/paper --png pictures"


def add_arguments(parser: ArgumentParser) -> None:
    """Add DIR and the flags that name what is written."""
    add = parser.add_argument
    add("folder", metavar="DIR", type=Path, help="an output folder")
    add("--png", metavar="DIR", type=Path, help="write pictures there instead of opening a window")
    add("--html", metavar="FILE", type=Path, help="write bodies and fields as one web page that needs no network")
    add_force_flag(parser)


def execute(arguments: Namespace) -> int:
    """Show an output folder in a window, or write what the flags ask for and print the paths; return exit code 0."""
    from pipeline.report.report import written_data

    written_data(arguments.folder)  # refuses another folder before anything heavy is loaded
    if arguments.png is None and arguments.html is None:
        from pipeline.view.pictures import pictures, show_pictures

        show_pictures(pictures(arguments.folder), arguments.folder.name)
        return 0
    paths = _write(arguments)
    for path in paths:
        print(path)
    return 0


def _write(arguments: Namespace) -> list[Path]:
    """Write what the flags ask for; return the paths."""
    paths: list[Path] = []
    if arguments.png is not None:
        from pipeline.view.pictures import pictures, write_pictures

        paths += write_pictures(pictures(arguments.folder), arguments.png, force=arguments.force)
    if arguments.html is not None:
        from pipeline.view.web_page import write_web_page

        paths.append(write_web_page(arguments.folder, arguments.html, force=arguments.force))
    return paths
