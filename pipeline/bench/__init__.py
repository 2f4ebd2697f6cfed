"""Speed against error, beside other codes."""
