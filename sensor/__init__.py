"""What a person chooses of a sensor, and its closed forms: no CAD, no finite elements."""
