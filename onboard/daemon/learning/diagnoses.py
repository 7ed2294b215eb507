"""What diagnoses said, for people: in the journal, among the notices, in the snapshot."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from typing import Any

from onboard.daemon.view.journal_lines import diagnosis_in_words
from onboard.daemon.view.notices import Notices
from onboard.push.diagnosed import Diagnosed
from onboard.push.entries import Entry, Found


class Diagnoses:
    """Tells of every diagnosis once.

    Args:
        write: appends to the journal; a disk that does not take it is its to tell.
        notices: where the news go.
    """

    def __init__(self, write: Callable[[Entry], object], notices: Notices) -> None:
        self._write = write
        self._notices = notices
        self._told: dict[int, Diagnosed] = {}

    def take(self, diagnosed: Mapping[int, Diagnosed]) -> None:
        """Take the learner's word; what was told already is no news."""
        for imu, found in diagnosed.items():
            if self._told.get(imu) is found:
                continue
            self._told[imu] = found
            if found.resumed:  # told before the restart
                continue
            self._write(Found(uuid.uuid4().hex, imu, found.verdict, found.effects, found.missing))
            text = f"IMU {imu}: {diagnosis_in_words(found.verdict, found.effects)}"
            if found.missing:
                text += f"; not to be written by itself: {found.missing}"
            self._notices.post("diagnosed", text, warning=bool(found.missing))

    def forget(self) -> None:
        """What was learned is reset."""
        self._told.clear()

    @property
    def document(self) -> dict[str, Any] | None:
        """``onboard.explain/1`` of the accelerometer that has most to say; None before any."""
        found = [self._told[imu] for imu in sorted(self._told)]
        if not found:
            return None
        return max(found, key=lambda d: (bool(d.missing), bool(d.effects))).document
