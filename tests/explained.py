"""Explanations of shared recordings, each worked out once a process: they take half a minute."""

from __future__ import annotations

import functools
from pathlib import Path

from onboard.answers.explain import Explanation, explain


@functools.cache
def explained(path: Path) -> Explanation:
    """What ``onboard explain`` says of a recording."""
    return explain([path])
