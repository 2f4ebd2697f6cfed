"""The parts of each error bar, and the scatter of prints."""
