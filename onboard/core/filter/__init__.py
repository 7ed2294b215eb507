"""Innovations: velocities predicted and compared, whitened, gated and added to block sums."""
