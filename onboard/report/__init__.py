"""Reports for people: a diagnosis as one self-contained page, and as a parameter file."""
