"""The vehicle's half of a mismatch: what makes the specific force that the accelerometer measures.

Flight on an even grid (:mod:`~onboard.core.vehicle.flight`), an airframe as ArduPilot's simulator
describes it (:mod:`~onboard.core.vehicle.airframe`), effects that change what it predicts
(:mod:`~onboard.core.vehicle.effects`, one file each), a fit on whitened residuals and a decision.
"""
