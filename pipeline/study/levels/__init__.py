"""What a point of a study is solved for: contact and closed forms, fitted springs, or a whole run."""
