"""One recording, or several of one vehicle, to a replay with what its report draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from onboard.answers.chronicle import Chronicle
from onboard.answers.chronicles import Chronicles
from onboard.answers.flights import Flights, distinct
from onboard.answers.flown_order import in_order
from onboard.answers.recorded import Recorded
from onboard.answers.replay import Progress, Replay, replay
from onboard.recordings.recording import Recording


@dataclass(frozen=True, slots=True)
class Calibrated:
    """A replay; ``chronicle`` is what its report draws, None if it was not kept."""

    replay: Replay
    chronicle: Chronicle | Chronicles | None


def calibrated(
    recordings: Sequence[str | Path | Recording],
    *,
    imu: int | None = None,
    watched: bool = False,
    progress: Progress | None = None,
) -> Calibrated:
    """Calibrate from recordings; several are merged in the order in which they were flown.

    Args:
        recordings: at least one, all of the same vehicle; files, or opened already; where they do
            not say when they were flown, in that order.
        imu: answer for this accelerometer only.
        watched: keep what a report draws.
        progress: told the share of the reading that is done.

    Raises:
        RecordingError: a file that cannot be used, or one of another vehicle.
        UsageError: none is given, one is given twice, dates contradict the order given of those
            that have none, or there is no such accelerometer.
    """
    wanted = () if imu is None else (imu,)
    estimator: Recorded | Flights
    flown = in_order(recordings)
    if len(recordings) > 1:
        paths = [r.path if isinstance(r, Recording) else Path(r) for r in flown.recordings]
        estimator = Flights(distinct(paths), wanted, watched=watched)
    else:
        estimator = Recorded(wanted, watched=watched)
    result = replay(flown.recordings, estimator, imu=imu, progress=progress)
    result = replace(result, notes=(*flown.notes, *result.notes))
    return Calibrated(result, estimator.chronicle)
