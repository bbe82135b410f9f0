"""Plugins that ship, planners, and links to other systems."""
