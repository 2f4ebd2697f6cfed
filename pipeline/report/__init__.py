"""What a run says: report.json, response.csv, the tables in the terminal."""
