"""A soak of landings: the whole daemon against the simulator, with all that happens around it."""
