"""TOML that somebody wrote: read whole, in bounded time and memory, or refused in one line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, Final

from onboard.errors import ConfigurationError

LONGEST_FILE: Final = 65536
"""bytes; the sample configuration, which shows every key, has 3500."""
LONGEST_LINE: Final = 4096
"""Characters; dotted keys as long as a file take the parser minutes."""


def read_toml(path: Path) -> dict[str, Any]:
    """Read a file as it stands, nothing checked but that it is TOML.

    Raises:
        ConfigurationError: it cannot be read or is not TOML.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LONGEST_FILE + 1)
    except OSError as error:
        raise ConfigurationError(f"{path}: {error.strerror or error}") from None
    except ValueError:  # a NUL in the path itself
        raise ConfigurationError(f"{str(path)!r}: not a file name") from None
    if len(data) > LONGEST_FILE:
        raise ConfigurationError(f"{path}: longer than {LONGEST_FILE} bytes")
    for number, line in enumerate(data.split(b"\n"), start=1):
        if len(line) > LONGEST_LINE:
            raise ConfigurationError(
                f"{path}: line {number} is longer than {LONGEST_LINE} characters"
            )
    try:
        return tomllib.loads(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path}: not UTF-8 text at byte {error.start}") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"{path}: not TOML: {error}") from None
    except RecursionError:
        raise ConfigurationError(f"{path}: not TOML that is meant: nested too deep") from None
    except ValueError:  # Python's limit on the digits of an integer
        raise ConfigurationError(f"{path}: a number with too many digits") from None
