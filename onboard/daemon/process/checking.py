"""What ``onboard run --check`` looks at: what would end a start, without opening anything."""

from __future__ import annotations

import time
from pathlib import Path

from onboard.daemon.setup import secret_files, settings
from onboard.daemon.setup.configuration import Configuration
from onboard.errors import ConfigurationError


def check(chosen: Configuration) -> None:
    """Read the secrets and certificates too, and see whether directories can be what they are for.

    Raises:
        ConfigurationError: the service would not start with this configuration.
    """
    settings.endpoints(chosen.link)
    settings.signing(chosen.link, time.time)
    if chosen.http.enabled:
        settings.http_token(chosen.http)
    _directory(chosen.state.path(), "[state] directory")
    if chosen.recording.enabled and chosen.recording.directory is not None:
        _directory(Path(chosen.recording.directory).expanduser(), "[recording] directory")
    if chosen.mqtt.enabled:
        from onboard.daemon.mqtt.tls import tls_context  # noqa: PLC0415 - few want it

        if chosen.mqtt.password_file is not None:
            secret_files.read_secret(chosen.mqtt.password_file, key="[mqtt] password_file")
        tls_context(chosen.mqtt)


def _directory(path: Path, key: str) -> None:
    """Refuse a place where no directory is and none can be made."""
    try:
        there = next(p for p in (path, *path.parents) if p.exists())
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ConfigurationError(f"{path} ({key}): {reason}") from None
    if not there.is_dir():
        raise ConfigurationError(f"{path} ({key}): {there} is not a directory")
