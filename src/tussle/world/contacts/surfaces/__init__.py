"""Contacts of bodies with the scene."""
