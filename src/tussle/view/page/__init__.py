"""The browser page that shows and controls a game."""
