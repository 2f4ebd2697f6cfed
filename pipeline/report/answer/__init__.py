"""What a run answers on the terminal, and whether it has to run at all for that."""
