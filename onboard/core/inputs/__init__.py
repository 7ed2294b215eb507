"""Samples to batches: what was measured, whose it is, whether the vehicle flew."""
