"""Autonomies with the laws of SCRIMMAGE."""
