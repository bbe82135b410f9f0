"""Stock interactions, one folder per plugin."""
