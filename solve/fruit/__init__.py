"""How the fruit gives under forces of the tips: its compliance."""
