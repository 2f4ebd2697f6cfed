"""The error budget of each number, and the scatter of prints."""
