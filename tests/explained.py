"""Answers about shared recordings, each worked out once a process: they take half a minute."""

from __future__ import annotations

import functools
from pathlib import Path

from onboard.answers.explain import Explanation, explain
from onboard.answers.recorded import Recorded
from onboard.answers.replay import Replay, replay


@functools.cache
def explained(path: Path) -> Explanation:
    """What ``onboard explain`` says of a recording."""
    return explain([path])


@functools.cache
def replayed(path: Path) -> Replay:
    """What ``onboard replay`` says of all accelerometers of a recording."""
    return replay([path], Recorded())
