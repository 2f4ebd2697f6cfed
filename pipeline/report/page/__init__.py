"""report.html: the answer, the plots and the pictures of a run in one self-contained file."""
