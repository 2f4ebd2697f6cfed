"""`pipeline view`: an output folder to look at, in a window, as pictures, as a web page or as a series."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from pipeline.commands.console import add_force_flag
from sensor.quantity import validation_error

PURPOSE = "show the parts, fields and response"
EXAMPLE = "pipeline view outputs/paper --png pictures"


def add_arguments(parser: ArgumentParser) -> None:
    """Add DIR, another one to compare it with, and the flags that name what is written."""
    add = parser.add_argument
    add("folder", metavar="DIR", type=Path, help="an output folder")
    add("other", metavar="OTHER", type=Path, nargs="?", help="another output folder, for --compare")
    add("--png", metavar="DIR", type=Path, help="write pictures there instead of opening a window")
    add("--html", metavar="FILE", type=Path, help="write bodies and fields as one web page that needs no network")
    add("--pvd", metavar="DIR", type=Path, help="write flexures and fruit over the travel there, a series for ParaView")
    add(
        "--compare",
        metavar="FILE",
        type=Path,
        nargs="?",
        const=Path("comparison.html"),
        help="write DIR and OTHER side by side as one web page (default comparison.html)",
    )
    add_force_flag(parser)


def execute(arguments: Namespace) -> int:
    """Show an output folder in a window, or write what the flags ask for and print the paths; return exit code 0."""
    from pipeline.report.report import written_data

    if (arguments.other is None) != (arguments.compare is None):
        hint = "write pipeline view DIR OTHER --compare"
        raise validation_error("OTHER", str(arguments.other), "", "given with --compare", hint)
    for folder in (arguments.folder, arguments.other):
        if folder is not None:
            written_data(folder)  # refuses another folder before anything heavy is loaded
    if all(flag is None for flag in (arguments.png, arguments.html, arguments.pvd, arguments.compare)):
        from pipeline.view.pictures import pictures
        from pipeline.view.window import show_pictures

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
    if arguments.pvd is not None:
        from pipeline.view.series import write_series

        paths += write_series(arguments.folder, arguments.pvd, force=arguments.force)
    if arguments.compare is not None:
        from pipeline.view.web_page import write_comparison

        folders = (arguments.folder, arguments.other)
        paths.append(write_comparison(folders, arguments.compare, force=arguments.force))
    return paths
