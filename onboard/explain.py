"""Recordings through the diagnosis: read as for a replay, then asked what is missing."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from onboard.core.calibrator import Calibrator
from onboard.core.diagnosis import diagnose
from onboard.core.findings import Diagnosis, Mismatch, NotTestable, Series, Verdict
from onboard.core.result import Calibration
from onboard.core.samples import ImuSample, Sample
from onboard.core.settings import EstimatorSettings
from onboard.explain_document import ExplainDocument, explain_document
from onboard.replay import Replay, replay

LONGEST_FLIGHT_S = 7200.0
"""All of a flight is looked at, up to two hours."""
PAUSE_S = 10.0
"""Between two recordings."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """A diagnosis and what it was made from."""

    diagnosis: Diagnosis
    source: Replay
    imu: int

    @property
    def files(self) -> list[str]:
        """Names of the recordings."""
        return [r.path.name for r in self.source.recordings]

    @property
    def duration_s(self) -> float:
        """Length of all recordings, s."""
        return sum(r.duration_s for r in self.source.recordings)

    def document(self) -> ExplainDocument:
        """``onboard.explain/1``."""
        return explain_document(
            self.diagnosis,
            files=self.files,
            autopilot=self.source.autopilot,
            duration_s=self.duration_s,
            samples={
                "imu": self.source.counts.get(f"imu {self.imu}", 0),
                "gps": self.source.counts.get("gps", 0),
            },
        )


def explain(
    paths: Sequence[str | Path],
    *,
    imu: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Explanation:
    """Read recordings of one vehicle and diagnose one accelerometer.

    Args:
        paths: at least one recording.
        imu: which accelerometer; the first that can be diagnosed if None.
        progress: told the share of the reading that is done.

    Raises:
        RecordingError: a file that cannot be used.
        UsageError: there is no such accelerometer.
    """
    calibrator, source = _read(paths, imu, frozenset({1, imu or 1}), progress)
    if imu is None and 1 not in calibrator.imus:
        calibrator, source = _read(paths, imu, frozenset(), progress)
    chosen = imu if imu is not None else min(calibrator.imus, default=1)
    if chosen in calibrator.imus:
        return Explanation(diagnose(calibrator, chosen), source, chosen)
    calibration = next((c for c in source.calibrations if c.imu == chosen), source.calibrations[0])
    return Explanation(nothing_to_say(calibration), source, calibration.imu)


def _read(
    paths: Sequence[str | Path],
    imu: int | None,
    wanted: frozenset[int],
    progress: Callable[[float], None] | None,
) -> tuple[Calibrator, Replay]:
    # Timing and noise are the diagnosis' own: estimating them while reading would be done twice.
    calibrator = Calibrator(EstimatorSettings(refine=False, buffer_s=LONGEST_FLIGHT_S))
    source = replay(paths, _Only(calibrator, wanted), imu=imu, progress=progress)
    # What it says of the accelerometers that were not fed is not so.
    return calibrator, replace(source, notes=())


class _Only:
    """Feeds a calibrator some accelerometers (none named: all): each costs as much as another.

    A recording follows on the one before: what happened at a time happened in one of them.
    """

    def __init__(self, calibrator: Calibrator, wanted: frozenset[int]) -> None:
        self._calibrator, self._wanted = calibrator, wanted
        self.finish, self.calibration = calibrator.finish, calibrator.calibration
        self._shift, self._newest, self._begins = 0.0, -math.inf, False

    @property
    def imus(self) -> tuple[int, ...]:
        return self._calibrator.imus

    def restart(self) -> object:
        self._begins = math.isfinite(self._newest)
        return self._calibrator.restart()

    def feed(self, sample: Sample) -> object:
        t = sample.t
        if t is not None and math.isfinite(t):
            if self._begins:
                self._shift, self._begins = self._newest + PAUSE_S - t, False
            if self._shift:
                sample = replace(sample, t=t + self._shift)
            self._newest = max(self._newest, t + self._shift)
        if self._wanted and isinstance(sample, ImuSample) and sample.imu not in self._wanted:
            return ()
        return self._calibrator.feed(sample)


def nothing_to_say(calibration: Calibration) -> Diagnosis:
    """The diagnosis of a recording without a usable stretch of flight."""
    nan = float("nan")
    empty = np.zeros((0, 3))
    return Diagnosis(
        imu=calibration.imu,
        verdict=Verdict.INSUFFICIENT,
        calibration=calibration,
        timing=calibration.timing,
        mismatch=Mismatch(
            detected=False,
            whitened_rms_before=nan,
            whitened_rms_after=nan,
            p_value=1.0,
            velocity_rms_before=nan,
            velocity_rms_after=nan,
            held_out_before=nan,
            held_out_after=nan,
        ),
        effects=(),
        ambiguous=(),
        not_testable=(NotTestable("everything", "no stretch of flight with trusted GPS"),),
        ladder=(),
        regimes=(),
        series=Series(np.zeros(0), empty, empty, np.zeros(0, dtype=bool)),
        note="no stretch of flight with trusted GPS and inertial data. " + calibration.note,
    )
