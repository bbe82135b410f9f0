"""Rays: surfaces, trees over them, and the first hits of rays."""
