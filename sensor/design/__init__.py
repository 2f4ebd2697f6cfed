"""What the user may choose, and what a process can print. It needs only the standard library."""
