"""Writing a calibration into the autopilot: what may be written, when, and how to undo it.

``plan`` says what would change, ``policy`` whether it may, ``transaction`` writes it all or
not at all, ``journal`` remembers it across a crash, ``watch`` judges it on the next flight.
"""
