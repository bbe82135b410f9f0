"""Controllers with the laws of SCRIMMAGE."""
