"""What a workshop is given beside the files of the part: sheet, bill of materials, test piece, cover, mount."""
