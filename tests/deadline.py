"""How long a test waits for whatever it waits for: many times what a machine takes that does other work."""

DEADLINE_S = 600.0
