"""`pipeline view`: pictures of an output folder, in a window or as files."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from pipeline.commands.console import add_force_flag
from pipeline.storage.interruption import interruptible

PURPOSE = "show the parts, fields and response"
EXAMPLE = "pipeline view outputs/paper --png pictures"


def add_arguments(parser: ArgumentParser) -> None:
    """Add DIR, --png and --force."""
    parser.add_argument("folder", metavar="DIR", type=Path, help="an output folder")
    parser.add_argument("--png", metavar="DIR", type=Path, help="write pictures there instead of opening a window")
    add_force_flag(parser)


def execute(arguments: Namespace) -> int:
    """Show an output folder in a window, or write its pictures into the folder `--png`; return exit code 0."""
    from pipeline.view.pictures import pictures, write_pictures
    from pipeline.view.window import show_pictures

    shown = pictures(arguments.folder)
    if arguments.png is None:
        show_pictures(shown, arguments.folder.name)
        return 0
    with interruptible():
        paths = write_pictures(shown, arguments.png, force=arguments.force)
    for path in paths:
        print(path)
    return 0
