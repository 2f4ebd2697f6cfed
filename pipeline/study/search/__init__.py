"""The best design of a study: every candidate is one of its points."""
