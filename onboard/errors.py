"""One tree of errors, by cause; the command line turns each cause into an exit status."""


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
    """The link or the autopilot failed: no heartbeat, port in use, connection refused."""

    exit_status = 3


class PushError(OnboardError):
    """Parameters could not be written, verified or rolled back; the journal has the rest."""

    exit_status = 3


class StateError(OnboardError):
    """Saved state (sums, journal) that cannot be read: damaged or of another version."""

    exit_status = 2


class RefusedError(OnboardError):
    """What a person asked of the running service cannot be done now; says why."""

    exit_status = 2
