"""Studies: variations of a base design, each solved once and stored in one file; begin with `run_study`."""

from pipeline.study.engines import Engine, process_engine
from pipeline.study.execute import StudySummary, run_study
from pipeline.study.study_file import Study, read_study

__all__ = ["Engine", "Study", "StudySummary", "process_engine", "read_study", "run_study"]
