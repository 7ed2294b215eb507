"""What can go wrong with a simulated autopilot, apart from the physics."""

from onboard.errors import LinkError


class SitlError(LinkError):
    """A simulator that does not start, does not answer, or refuses to fly."""


class NoBinaryError(SitlError):
    """There is no ArduPilot SITL binary here; says where it was looked for."""
