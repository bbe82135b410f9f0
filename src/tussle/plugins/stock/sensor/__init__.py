"""Stock sensors, one folder per plugin."""
