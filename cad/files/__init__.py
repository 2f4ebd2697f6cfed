"""Files of solids. Equal solids give files with equal bytes on every machine."""
