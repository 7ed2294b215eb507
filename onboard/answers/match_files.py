"""Frame files that a match compares with, and what it hands back to the simulator; plain ASCII."""

from __future__ import annotations

import json
from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Final

from onboard.answers.match import Match
from onboard.answers.match_words import number
from onboard.errors import UsageError

DIGITS: Final = 7
"""Of a parameter: the 24 bits of single precision are 7.2 decimal digits [data sheet]."""


def settings_text(match: Match) -> str:
    """``NAME,VALUE`` lines with a comment before each; only what is proven."""
    lines = [f"# onboard match: {match.real.name}", f"# verdict {match.verdict.value}"]
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
        UsageError: it cannot be read, or is no JSON object.
    """
    try:
        found = json.loads(Path(file).read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"{fspath(file)}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{fspath(file)}: no JSON ({error})") from None
    if not isinstance(found, dict):
        raise UsageError(f"{fspath(file)}: no JSON object")
    return found


def _plain(value: float) -> str:
    return f"{value:.{DIGITS}g}"
