"""Sensors with the laws of SCRIMMAGE."""
