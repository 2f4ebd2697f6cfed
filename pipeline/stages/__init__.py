"""The stages of a run, each from frozen inputs to a frozen result."""
