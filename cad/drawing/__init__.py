"""Drawings that a workshop can work from: views, dimensions, frame and title block, as DXF and as SVG."""
