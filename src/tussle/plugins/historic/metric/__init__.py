"""Metrics with the laws of SCRIMMAGE."""
