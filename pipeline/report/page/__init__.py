"""report.html: the answer, the plots and the pictures of a run in one file that needs nothing else."""
