"""Ways of bodies in a step, shortened where something is in the way."""
