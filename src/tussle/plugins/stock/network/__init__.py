"""Stock networks, one folder per plugin."""
