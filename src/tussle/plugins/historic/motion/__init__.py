"""Motion models with the laws of SCRIMMAGE."""
