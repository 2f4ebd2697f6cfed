"""What the pictures of the page are drawn with: scales with their ticks, panels, pixels; written as SVG."""
