"""Stock metrics, one folder per plugin."""
