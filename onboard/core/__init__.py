"""The pure core: numpy only, no clock, no asyncio, no sockets, no MAVLink.

Samples enter through :class:`onboard.core.estimate.calibrator.Calibrator`, whether they come
from a live link or from a recording; results leave it as frozen records.
"""
