"""The searches of `suggest` and `optimise`: candidates, their quick model, their shortfall, and the proof by a run."""
