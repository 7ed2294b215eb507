"""A real ArduPilot SITL binary: found, started, given a truth, and stopped."""
