"""`pipeline view`: show an output folder in a window, or write it as pictures or a web page."""

from argparse import Namespace

from pipeline.report.report import written_data
from twintip.commands.console import PASSED, Answer
from twintip.commands.progress import showing_progress


def run(arguments: Namespace) -> Answer:
    """Show an output folder in a window, or write the pictures, the web page or both, as the flags request.

    Without a flag, the folder is shown in a window. Raises InputError if the folder is not the output of a run.
    """
    written_data(arguments.folder)  # rejects any other folder before slow modules are loaded
    folder = arguments.folder
    written = []
    with showing_progress(f"reading {folder.name}") as work:
        from pipeline.view.pictures import pictures, show_pictures, write_pictures
        from pipeline.view.web_page import write_web_page

        in_window = arguments.png is None and arguments.html is None
        scenes = pictures(folder) if in_window or arguments.png is not None else []
        if arguments.png is not None:
            work("drawing pictures")
            written += write_pictures(scenes, arguments.png, force=arguments.force, count=work.count)
        if arguments.html is not None:
            work(f"writing {arguments.html.name}")
            written.append(write_web_page(folder, arguments.html, force=arguments.force))
    if in_window:  # the progress has been erased, and the window stays open until the user closes it
        show_pictures(scenes, folder.name)
    return Answer(code=PASSED, files=written)
