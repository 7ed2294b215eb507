"""A serial port as a raw, non-blocking descriptor, by termios."""

from __future__ import annotations

import errno
import fcntl
import os
import termios

from onboard.errors import UnavailableError
from onboard.mavlink.endpoint import BAUD_RATES, Endpoint, EndpointError


def open_serial(endpoint: Endpoint) -> int:
    """Open and set up a serial device: raw, 8N1, no flow control, ours alone.

    Flow control stays off because companion wiring usually has three wires; a port wired
    with RTS/CTS works without it as long as we read fast enough, and we do.

    Raises:
        EndpointError: not a terminal device.
        UnavailableError: another program has it open, or we may not (perhaps not yet: udev).
        OSError: the device is not there (perhaps not yet: USB).
    """
    try:
        descriptor = os.open(
            endpoint.device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC
        )
    except PermissionError:
        raise UnavailableError(
            f"{endpoint}: no permission to open it (is the user in the group of the device?)"
        ) from None
    except OSError as error:
        if error.errno == errno.EBUSY:
            raise UnavailableError(f"{endpoint}: port in use by another program") from None
        raise
    try:
        try:
            # TIOCEXCL does not hold root off; the lock does, among programs that take it.
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UnavailableError(f"{endpoint}: port in use by another program") from None
        _configure(descriptor, BAUD_RATES[endpoint.baud])
        fcntl.ioctl(descriptor, termios.TIOCEXCL)
    except termios.error as error:
        os.close(descriptor)
        if error.args[0] == errno.ENOTTY:
            raise EndpointError(f"{endpoint}: not a serial device") from None
        raise OSError(*error.args) from None
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def _configure(descriptor: int, speed: int) -> None:
    attributes = termios.tcgetattr(descriptor)
    control = attributes[2] & ~(
        termios.CSIZE | termios.PARENB | termios.CSTOPB | termios.CRTSCTS | termios.HUPCL
    )
    control |= termios.CS8 | termios.CREAD | termios.CLOCAL
    characters = attributes[6]
    characters[termios.VMIN] = 1
    characters[termios.VTIME] = 0
    # Input, output and local flags all off: every byte goes through as it is.  HUPCL off: no
    # DTR pulse on closing, which would reset some boards.
    termios.tcsetattr(descriptor, termios.TCSANOW, [0, 0, control, 0, speed, speed, characters])
    termios.tcflush(descriptor, termios.TCIOFLUSH)
