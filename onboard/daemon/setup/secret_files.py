"""Files with secrets in them: read, and refused where everybody may read them too."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from onboard.daemon.setup.configuration import Configuration
from onboard.errors import ConfigurationError

LONGEST_SECRET = 4096
"""bytes; more is not read."""


def refuse_open_token(path: Path, chosen: Configuration) -> None:
    """Refuse a file that has a token in it and that everybody may read.

    Raises:
        ConfigurationError: it has, and they may.
    """
    if chosen.http.token is not None and path.stat().st_mode & stat.S_IRWXO:
        raise ConfigurationError(
            f"{path}: everybody may read the [http] token in it; chmod 600 it, or keep the token "
            "in a token_file of its own"
        )


def read_secret(path: str, *, key: str) -> str:
    """First line of a secret's own file, which nobody but its owner and group may read.

    Raises:
        ConfigurationError: it cannot be read, is empty, or everybody may; ``key`` is named.
    """
    try:
        with Path(path).expanduser().open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            text = file.read(LONGEST_SECRET).decode("utf-8")
    except (OSError, ValueError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigurationError(f"{path} ({key}): {reason}") from None
    lines = text.splitlines()
    if not lines or not lines[0].strip():
        raise ConfigurationError(f"{path} ({key}): empty")
    if not lines[0].strip().isprintable():
        raise ConfigurationError(f"{path} ({key}): not a text file")
    if mode & (stat.S_IRWXO | stat.S_IWGRP):
        who = "everybody" if mode & stat.S_IRWXO else "its group"
        raise ConfigurationError(
            f"{path} ({key}): {who} may read or change this secret (mode "
            f"{stat.S_IMODE(mode):04o}); chmod 600 it, and choose another one if others were here"
        )
    return lines[0].strip()
