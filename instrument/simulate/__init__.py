"""Simulated units with drawn errors, pressed on fruit by boundary elements; they write the files of real ones."""
