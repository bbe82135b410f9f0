"""Contacts of boxes with boxes and triangles."""
