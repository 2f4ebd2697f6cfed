"""Tips on the fruit: their contact, its pressure, and the forces that the sensor reads."""
