"""One tree of errors, by cause; the command line turns each cause into an exit status."""

from __future__ import annotations

import errno
from pathlib import Path


class OnboardError(Exception):
    """Anything that this package raises on purpose: one clear line for a person."""

    exit_status = 1


class UsageError(OnboardError):
    """Wrong command line, configuration or input file: the user can mend it."""

    exit_status = 2


class ConfigurationError(UsageError):
    """A configuration file or value that cannot be used; names file and key."""


class RecordingError(UsageError):
    """A file that is absent, is not a log, or holds nothing usable; names the file."""


class ArraysError(UsageError):
    """Arrays that cannot be a flight: a shape, a unit, a time; names the column."""


class ExtraError(UsageError):
    """Something was asked for that needs an optional package; names the package and the extra."""


class LinkError(OnboardError):
    """The link or the autopilot failed: no heartbeat, connection refused."""

    exit_status = 3


class UnavailableError(OnboardError):
    """Another program has it, or it is not there for us yet: worth another try later.

    A port, an address or a serial device: while a machine starts, or a service is replaced, each
    of them may be somebody else's for seconds.
    """

    exit_status = 3


class PushError(OnboardError):
    """Parameters could not be written, verified or rolled back; the journal has the rest."""

    exit_status = 3


class StateError(OnboardError):
    """Saved state (sums, journal) that cannot be read: damaged or of another version."""

    exit_status = 2


class DiskError(StateError):
    """The disk is full, read-only or failing: what it does not do now it may do again later."""


class HeldError(StateError):
    """Another process has the state directory: a service that is still ending, perhaps."""

    exit_status = 3


def disk_error(path: Path, error: OSError) -> StateError:
    """What the disk said of a file, as one of ours: a :class:`DiskError` if it is the disk's fault.

    A wrong path or a permission that is missing is not: somebody has to mend that.
    """
    kind = DiskError if error.errno in _OF_THE_DISK else StateError
    return kind(f"{path}: {error.strerror or error}")


class RefusedError(OnboardError):
    """What a person asked of the running service cannot be done now; says why."""

    exit_status = 2


NOT_OURS = frozenset({errno.EADDRINUSE, errno.EADDRNOTAVAIL})
"""What a socket says of an address that is another program's, or none of this machine's (yet)."""
_OF_THE_DISK = frozenset(
    {errno.EIO, errno.ENOSPC, errno.EROFS, errno.EDQUOT, errno.ENXIO, errno.ENODEV, errno.ESTALE}
)
