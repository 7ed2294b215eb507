"""The MAVLink edge: bytes in, samples and protocol answers out.

A message enters at :mod:`transport`, is framed and verified by :mod:`codec`, handed on by
:class:`onboard.mavlink.link.Link`, and becomes a sample in :mod:`decode`.  Everything but
``transport``, ``link`` and ``recorder`` is sans-IO: bytes or messages in, values out, the
time passed in.
"""
