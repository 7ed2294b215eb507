"""Sums to an answer: the calibration with its sigmas, what it rests on, how it is kept."""
