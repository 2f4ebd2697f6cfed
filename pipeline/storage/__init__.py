"""Storage of results: the output folder, the cache, and VTU files for ParaView."""
