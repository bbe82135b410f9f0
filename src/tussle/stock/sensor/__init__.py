"""Sensors that ship with tussle, a folder each."""
