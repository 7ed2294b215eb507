"""Samples to estimates: whose they are, the flight judged after landing, what is kept."""
