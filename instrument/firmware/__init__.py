"""The programs of a unit: a C header, a MicroPython module, and loggers for its board."""
