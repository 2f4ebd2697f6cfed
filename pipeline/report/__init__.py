"""The output of a run: report.json, response.csv, and tables in the terminal."""
