"""Stock controllers, one folder per plugin."""
