"""Stock motion models, one folder per plugin."""
