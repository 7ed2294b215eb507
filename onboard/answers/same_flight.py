"""Whether recordings that are used together are of one vehicle, and of flights of their own.

A flight that is counted twice is believed too much, whether as a copy of a file, or as the
autopilot's log and the telemetry of it.  Dates do not tell that: simulators fly many flights at
once.  Places do: a receiver gives them to 1e-7 degrees, a centimetre, and no two flights go through
the same centimetres one after the other.
"""

from __future__ import annotations

import filecmp
import math
from collections.abc import Sequence
from typing import NoReturn

from onboard.core.inputs.samples import FIX_3D, GpsFix
from onboard.errors import RecordingError, UsageError
from onboard.recordings.provenance import provenance
from onboard.recordings.recording import Recording

MOVING_M_S = 1.0
"""A walk; what stands is in one place in every flight from there [physics]."""
FEWEST = 20
"""Places that are compared at the least: by chance two flights share hardly one [probability]."""
SHARE = 0.5
"""Of the places of the shorter one.  Telemetry leaves out some; a flight shares none with another
[probability]."""
PER_DEGREE = 1e9
"""Finer than a receiver's steps, which are rounded back to themselves."""


class Track:
    """Where a recording says that the vehicle went.

    Attributes:
        recording: whose it is.
    """

    def __init__(self, recording: Recording) -> None:
        """Begin one."""
        self.recording = recording
        self._places: set[tuple[int, int]] = set()

    def add(self, fix: GpsFix) -> None:
        """Take a fix."""
        if fix.fix_type < FIX_3D or not math.hypot(fix.v_n, fix.v_e) > MOVING_M_S:
            return
        place = math.degrees(fix.latitude), math.degrees(fix.longitude)
        if all(map(math.isfinite, place)):
            self._places.add((round(place[0] * PER_DEGREE), round(place[1] * PER_DEGREE)))

    def is_of(self, other: Track) -> bool:
        """Whether both went through the same places."""
        fewer = min(len(self._places), len(other._places))
        return fewer >= FEWEST and len(self._places & other._places) >= SHARE * fewer


def refuse_one_flight_twice(tracks: Sequence[Track]) -> None:
    """See that every recording is of a flight of its own.

    Raises:
        UsageError: two of them are of one.
        RecordingError: one of them has a flight twice.
    """
    for k, track in enumerate(tracks):
        for other in tracks[:k]:
            if not track.is_of(other):
                continue
            if track.recording is other.recording:
                raise RecordingError(f"{track.recording.path}: the same flight is in it twice")
            _refuse(track.recording, other.recording)


def refuse_copies(recordings: Sequence[Recording]) -> None:
    """See that no recording is another one, or a copy: a hover goes to no places that tell it.

    Raises:
        UsageError: one of them is.
    """
    for k, recording in enumerate(recordings):
        for other in recordings[:k]:
            if recording.path.resolve() == other.path.resolve():
                raise UsageError(f"{recording.path}: given twice")
            try:
                alike = filecmp.cmp(recording.path, other.path, shallow=False)
            except OSError:  # arrays of a program
                continue
            if alike:
                _refuse(recording, other)


def _refuse(recording: Recording, other: Recording) -> NoReturn:
    raise UsageError(f"{recording.path}: the same flight as {other.path}; give one of the two")


def refuse_other_boards(recordings: Sequence[Recording]) -> None:
    """See that no recording names another board than the others.

    Identifiers of sensors are alike on every board of a model; its serial number is its own.

    Raises:
        RecordingError: one of them does.
    """
    known: tuple[str, Recording] | None = None
    for recording in recordings if len(recordings) > 1 else ():
        try:
            board = provenance(recording.path).board
        except (OSError, RecordingError):  # arrays of a program, a table
            continue
        if not board:
            continue
        if known is None:
            known = board, recording
        # MAVLink has a short one and a long one.
        elif board != known[0] and len(board) == len(known[0]):
            raise RecordingError(
                f"{recording.path}: of another vehicle than {known[1].path} "
                f"(board {board}, there {known[0]})"
            )
