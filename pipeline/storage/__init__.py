"""Where results are kept: the output folder, the cache, VTU files."""
