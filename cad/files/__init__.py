"""Files of solids. Identical solids give identical files, but OCCT may order the entities of STEP files differently."""
