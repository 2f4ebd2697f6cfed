"""`pipeline view`: an output folder to look at, in a window, as pictures or as a web page."""

from argparse import Namespace

from pipeline.report.report import written_data
from twintip.commands.console import PASSED, Answer


def run(arguments: Namespace) -> Answer:
    """Show an output folder in a window, or write the files that the flags name."""
    written_data(arguments.folder)  # refuses another folder before anything heavy is loaded
    from pipeline.view.pictures import pictures, show_pictures, write_pictures
    from pipeline.view.web_page import write_web_page

    folder = arguments.folder
    files = []
    if arguments.png is not None:
        files += write_pictures(pictures(folder), arguments.png, force=arguments.force)
    if arguments.html is not None:
        files.append(write_web_page(folder, arguments.html, force=arguments.force))
    if arguments.png is None and arguments.html is None:
        show_pictures(pictures(folder), folder.name)
    return Answer(code=PASSED, files=files)
