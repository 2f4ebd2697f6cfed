"""What a person may choose, and what a process can print; the standard library only."""
