"""Simulated autopilots: flights whose truth is known, for demonstrations, tests and benchmarks.

Nothing here uses the estimator.  Flights are generated from rigid-body physics at 1 kHz, seen
through imperfect sensors, and spoken over MAVLink as ArduPilot speaks it.  The vocabulary
(frames ``b``, ``s``, ``n``; symbols ``f``, ``w``, ``v``, ``R_nb``; SI units) is that of the
:mod:`onboard` package.

``sitl.builtin``    the built-in autopilot, faster than real time, no other programs needed
``sitl.ardupilot``  a real ArduPilot SITL binary, flown with MAVSDK
``sitl.harness``    one interface over both
``sitl.recording``  flights straight to a .tlog or to messages, as fast as possible
"""
