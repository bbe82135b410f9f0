"""Runs the plugins of a mission on the rows of a stack of worlds."""
