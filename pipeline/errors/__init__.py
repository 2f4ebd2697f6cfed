"""The error budgets of the results of a sensor, and the scatter of prints."""
