"""The reader of measured tables."""
