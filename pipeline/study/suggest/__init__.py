"""The nearest design that passes, proved by a run."""
