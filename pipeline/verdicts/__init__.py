"""Is the sensor good enough in the scene that was asked for, and what would make it so."""
