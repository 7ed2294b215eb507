"""The service manager's notification protocol: one datagram to $NOTIFY_SOCKET."""

from __future__ import annotations

import os
import socket


class Notifier:
    """Tells systemd how the service is; does nothing where no manager listens."""

    def __init__(self, address: str | None) -> None:
        self._address = "\0" + address[1:] if address and address.startswith("@") else address

    @classmethod
    def from_environment(cls) -> Notifier:
        """The manager that started this process, if one did."""
        return cls(os.environ.get("NOTIFY_SOCKET"))

    def send(self, **fields: str) -> None:
        """One notification, for example ``send(READY="1", STATUS="calibrating")``.

        A manager that has gone away is not a reason to stop calibrating: errors are dropped.
        """
        if not self._address:
            return
        message = "\n".join(f"{name}={value}" for name, value in fields.items()).encode()
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as manager:
                manager.settimeout(0.0)
                manager.sendto(message, self._address)
        except OSError:
            return
