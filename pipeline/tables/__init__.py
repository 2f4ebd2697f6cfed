"""The one reader of measured tables."""
