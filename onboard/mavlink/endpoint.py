"""Endpoints as people write them: ``udpin:``, ``udpout:``, ``tcp:`` and ``serial:`` strings."""

from __future__ import annotations

import ipaddress
import termios
from dataclasses import dataclass
from enum import Enum

from onboard.errors import ConfigurationError, UsageError
from onboard.mavlink import limits

BAUD_RATES: dict[int, int] = {
    int(name[1:]): getattr(termios, name)
    for name in dir(termios)
    if name[0] == "B" and name[1:].isdigit() and int(name[1:]) >= 1200
}
"""The termios constant of each baud rate that this system knows."""


class EndpointError(UsageError):
    """An endpoint that cannot be opened as asked: no serial device, a port that is not allowed."""


class EndpointKind(Enum):
    """How bytes travel.  ``udpin`` listens and answers whoever speaks; ``udpout`` speaks first."""

    UDP_IN = "udpin"
    UDP_OUT = "udpout"
    TCP = "tcp"
    SERIAL = "serial"


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Where an autopilot (or a ground station) is reached.

    ``host`` and ``port`` serve UDP and TCP (an empty host listens on all IPv4 interfaces),
    ``device`` and ``baud`` serve serial ports.
    """

    kind: EndpointKind
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = 0

    @property
    def is_open_to_a_network(self) -> bool:
        """Whether packets of other machines can come in by UDP, whose senders are easily forged."""
        if self.kind not in (EndpointKind.UDP_IN, EndpointKind.UDP_OUT):
            return False
        if self.host == "localhost":
            return False
        try:
            return not ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return True  # no host: all interfaces; a name: wherever it leads

    @classmethod
    def parse(cls, text: str) -> Endpoint:
        """Read an endpoint string; ``udp:`` is ``udpin:``, and ``:BAUD`` may be left out.

        Raises:
            ConfigurationError: what is wrong, with the string quoted.
        """
        scheme, colon, rest = text.strip().partition(":")
        if scheme == "udp":
            scheme = "udpin"
        try:
            kind = EndpointKind(scheme)
        except ValueError:
            kind = None
        if kind is None or not colon:
            raise ConfigurationError(
                f"endpoint {text!r}: must start with udpin:, udpout:, tcp: or serial:"
            )
        if kind is EndpointKind.SERIAL:
            return cls._parse_serial(text, rest)
        return cls._parse_address(text, kind, rest)

    @classmethod
    def _parse_address(cls, text: str, kind: EndpointKind, rest: str) -> Endpoint:
        host, colon, port_text = rest.rpartition(":")
        if not colon:
            raise ConfigurationError(f"endpoint {text!r}: expected {kind.value}:HOST:PORT")
        if host.startswith("[") and host.endswith("]"):
            host = host[1:-1]
        elif ":" in host:
            raise ConfigurationError(f"endpoint {text!r}: put an IPv6 address in brackets")
        if not (port_text.isascii() and port_text.isdigit()):
            raise ConfigurationError(f"endpoint {text!r}: port {port_text!r} is not a number")
        port = int(port_text)
        if not 1 <= port <= 65535 and not (port == 0 and kind is EndpointKind.UDP_IN):
            raise ConfigurationError(f"endpoint {text!r}: port {port} is not within 1 to 65535")
        if not host and kind is not EndpointKind.UDP_IN:
            raise ConfigurationError(f"endpoint {text!r}: the host is missing")
        return cls(kind, host=host, port=port)

    @classmethod
    def _parse_serial(cls, text: str, rest: str) -> Endpoint:
        device, baud = rest, limits.DEFAULT_BAUD
        head, colon, tail = rest.rpartition(":")
        if colon:
            if not (tail.isascii() and tail.isdigit()):
                raise ConfigurationError(f"endpoint {text!r}: baud rate {tail!r} is not a number")
            device, baud = head, int(tail)
        if not device:
            raise ConfigurationError(f"endpoint {text!r}: expected serial:DEVICE:BAUD")
        if baud not in BAUD_RATES:
            known = ", ".join(str(rate) for rate in sorted(BAUD_RATES))
            raise ConfigurationError(f"endpoint {text!r}: baud rate {baud} is not one of {known}")
        return cls(EndpointKind.SERIAL, device=device, baud=baud)

    def __str__(self) -> str:
        if self.kind is EndpointKind.SERIAL:
            return f"serial:{self.device}:{self.baud}"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.kind.value}:{host}:{self.port}"
