"""Files of solids. Identical solids give identical files on every machine."""
