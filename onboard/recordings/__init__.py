"""Readers of recordings: MAVLink .tlog, ArduPilot DataFlash .BIN, PX4 .ulg.

Each reader turns a file into the same samples, in the same order of arrival, that a live
link would have given; :func:`onboard.recordings.opening.open_recording` chooses the reader.
"""
