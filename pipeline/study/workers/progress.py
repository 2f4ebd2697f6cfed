"""What a person sees of a running study: points, rate and time left, on a terminal only; and where it runs."""

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from pipeline.study.execute import Progress as Report
from pipeline.study.workers.cluster import cluster_engine
from pipeline.study.workers.engine import Engine, process_engine


class _Rate(ProgressColumn):
    """Points a second."""

    def render(self, task: Task) -> Text:
        """Return the rate in words, nothing before there is one."""
        return Text("" if not task.speed else f"{task.speed:.3g} points/s")


@contextmanager
def shown_progress() -> Iterator[Report]:
    """Give what a study reports its points to: a line on stderr where that is a terminal, else nothing."""
    console = Console(stderr=True)
    columns = (TextColumn("points"), BarColumn(), MofNCompleteColumn(), _Rate(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not sys.stderr.isatty(), transient=True) as bar:
        line = bar.add_task("points", total=None)
        yield lambda solved, count: bar.update(line, completed=solved, total=count)


def chosen_engine(processes: int | None, scheduler: str | None) -> AbstractContextManager[Engine]:
    """Return the cluster of a scheduler where one is named, else a pool of processes on this machine."""
    return process_engine(processes) if scheduler is None else cluster_engine(scheduler)
