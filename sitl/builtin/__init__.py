"""The built-in autopilot: flight, sensors, attitude filter, parameters, streams, server."""
