"""Autopilots that fly vehicles: their frames, the channels of their servos, and waiting for them."""
