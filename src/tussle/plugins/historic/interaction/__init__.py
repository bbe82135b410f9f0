"""Interactions with the laws of SCRIMMAGE."""
