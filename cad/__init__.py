"""The part itself: its solids, drawings and files."""
