"""WHAT the sensor is: numbers, closed forms, solids."""
