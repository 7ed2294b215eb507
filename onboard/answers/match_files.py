"""Frame files that a match compares with, and what it hands back to the simulator; plain ASCII."""

from __future__ import annotations

import json
from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Final

from onboard.answers.match import Match
from onboard.answers.match_words import number
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.errors import UsageError
from onboard.printable import in_ascii

LONGEST_FRAME: Final = 1_000_000
"""bytes; frame files have some thousand [cost]."""
DIGITS: Final = 7
"""Of a parameter: the 24 bits of single precision are 7.2 decimal digits [data sheet]."""


def settings_text(match: Match) -> str:
    """``NAME,VALUE`` lines with a comment before each; only what is proven."""
    # A name of a file may have an end of a line in it: what follows would be a setting.
    lines = [f"# onboard match: {in_ascii(match.real.name)}", f"# verdict {match.verdict.value}"]
    if not match.settings:
        lines.append("# nothing to change")
    for s in match.settings:
        sigma = f", sigma {number(s.sigma, s.sigma)}" if s.sigma > 0.0 else ""
        lines.append(f"# {s.reason}{sigma}")
        lines.append(f"{s.name},{_plain(s.value)}")
    return "\n".join(lines) + "\n"


def frame_text(match: Match) -> str:
    """A JSON object for SITL's ``--model``."""
    return json.dumps(dict(match.frame), indent=2) + "\n"


def read_frame(file: str | PathLike[str]) -> Mapping[str, object]:
    """Keys of a frame or coefficient file.

    Raises:
        UsageError: it cannot be read, or is none.
    """
    try:
        with Path(file).open("rb") as opened:
            data = opened.read(LONGEST_FRAME + 1)
        if len(data) > LONGEST_FRAME:
            raise UsageError(f"{fspath(file)}: longer than {LONGEST_FRAME} bytes, no frame file")
        found = json.loads(data)
    except OSError as error:
        raise UsageError(f"{fspath(file)}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{fspath(file)}: no JSON ({error})") from None
    if not isinstance(found, dict):
        raise UsageError(f"{fspath(file)}: no JSON object")
    return checked_frame(found, fspath(file))


def checked_frame(keys: Mapping[str, object], where: str) -> Mapping[str, object]:
    """The same keys, of which an airframe can be made.

    Raises:
        UsageError: it cannot; names ``where`` they come from.
    """
    try:
        CopterAirframe.of(keys)
        PlaneAirframe.of(keys)
    except ValueError as error:
        raise UsageError(f"{where}: no frame of a simulator ({error})") from None
    return keys


def _plain(value: float) -> str:
    return f"{value:.{DIGITS}g}"
