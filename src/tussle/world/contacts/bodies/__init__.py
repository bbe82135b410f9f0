"""Contacts of spheres, capsules and boxes with each other."""
