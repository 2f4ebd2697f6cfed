"""The meaning of every verdict and symbol: its formula, its source, and its value for a design."""
