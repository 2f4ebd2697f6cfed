"""The search of `suggest` and `optimise`: candidates, their cheap model, their shortfall, and the proof by a run."""
