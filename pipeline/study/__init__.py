"""Studies: many designs around one, solved once each, kept in one file: `from pipeline.study import run_study`."""

from pipeline.study.engines import Engine, process_engine
from pipeline.study.execute import StudySummary, run_study
from pipeline.study.study_file import Study, read_study

__all__ = ["Engine", "Study", "StudySummary", "process_engine", "read_study", "run_study"]
