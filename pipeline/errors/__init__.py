"""What each error bar is made of, and how far a print may be off."""
