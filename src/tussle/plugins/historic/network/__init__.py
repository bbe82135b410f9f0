"""Networks with the laws of SCRIMMAGE."""
