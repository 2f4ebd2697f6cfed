"""The meaning of every verdict and symbol: formula, source, and the number of a design."""
