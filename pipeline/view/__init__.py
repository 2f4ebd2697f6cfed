"""Pictures and web pages of the parts and fields in an output folder."""
