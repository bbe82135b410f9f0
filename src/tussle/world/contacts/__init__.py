"""Contacts between bodies and with the scene: where they touch, and the impulses that keep them apart."""
