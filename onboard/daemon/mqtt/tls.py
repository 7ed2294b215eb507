"""TLS to the broker, as [mqtt] asks for it."""

from __future__ import annotations

import contextlib
import ssl
from collections.abc import Iterator
from pathlib import Path

from onboard.daemon.setup.configuration import MqttSettings
from onboard.errors import ConfigurationError


def tls_context(settings: MqttSettings) -> ssl.SSLContext | None:
    """What [mqtt] says of TLS; None for plain text.

    Raises:
        ConfigurationError: a file that cannot be read or holds no certificate or key.
    """
    if not settings.tls:
        return None
    context = ssl.create_default_context()
    if settings.ca_file is not None:
        with _explained(settings.ca_file, "ca_file"):
            # Only this authority: a broker of one's own is not vouched for by the web's.
            context = ssl.create_default_context(cafile=str(Path(settings.ca_file).expanduser()))
    if settings.certificate_file is not None and settings.key_file is not None:
        with _explained(f"{settings.certificate_file}, {settings.key_file}", "certificate_file"):
            context.load_cert_chain(
                Path(settings.certificate_file).expanduser(),
                Path(settings.key_file).expanduser(),
                password=_no_passphrase,
            )
    return context


def _no_passphrase() -> str:
    """Instead of OpenSSL's question at a terminal that a service does not have."""
    return ""


@contextlib.contextmanager
def _explained(files: str, key: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:  # ssl.SSLError is one
        reason = error.strerror or str(error)
        if isinstance(error, ssl.SSLError):
            reason = f"no usable certificate or key ({error.reason or reason})"
        raise ConfigurationError(f"{files} ([mqtt] {key}): {reason}") from None
