"""Stock autonomies, one folder per plugin."""
