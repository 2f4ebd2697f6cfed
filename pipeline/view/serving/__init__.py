"""Scenes served to a browser on this machine, to those alone who have the address that was printed."""
