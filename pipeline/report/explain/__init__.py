"""What every verdict and symbol means: formula, source, and this design's number."""
