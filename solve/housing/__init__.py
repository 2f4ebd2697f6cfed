"""How the printed housing gives under forces on its tips."""
