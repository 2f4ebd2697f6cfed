"""`pipeline view`: an output folder in a window, as pictures or as a web page."""

from argparse import Namespace

from pipeline.report.report import written_data
from twintip.commands.console import PASSED, Answer
from twintip.commands.progress import showing_progress


def run(arguments: Namespace) -> Answer:
    """Show an output folder in a window, or write the files that the flags name."""
    written_data(arguments.folder)  # refuses another folder before anything heavy is loaded
    folder = arguments.folder
    files = []
    with showing_progress(f"reads {folder.name}") as work:
        from pipeline.view.pictures import pictures, show_pictures, write_pictures
        from pipeline.view.web_page import write_web_page

        in_window = arguments.png is None and arguments.html is None
        drawn = pictures(folder) if in_window or arguments.png is not None else []
        if arguments.png is not None:
            work("draws pictures")
            files += write_pictures(drawn, arguments.png, force=arguments.force, count=work.count)
        if arguments.html is not None:
            work(f"writes {arguments.html.name}")
            files.append(write_web_page(folder, arguments.html, force=arguments.force))
    if in_window:
        show_pictures(drawn, folder.name)
    return Answer(code=PASSED, files=files)
