"""Writing a calibration into the autopilot: what may be written, when, and how to undo it.

``plan`` says what would change, ``policy`` whether it may, ``transaction`` writes it all or
not at all (``states`` is its machine, ``course`` its steps, ``progress`` its notes, ``answers``
what the autopilot's words lead to, ``signals`` its border, ``reading`` its judgement),
``journal`` remembers ``entries`` across a crash, ``watch`` judges it on the next flight.
"""
