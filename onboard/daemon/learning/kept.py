"""What passed the diagnosis, by accelerometer: all that is kept over boots and on the disk."""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Iterator

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.saving import SavedEngine
from onboard.core.estimate.settings import CalibratorSettings


def calibrator_anew(settings: CalibratorSettings) -> Calibrator:
    """One whose sums have a name that no others have."""
    return Calibrator(settings, flight=name_of_a_flight())


def name_of_a_flight() -> str:
    """A new one, 16 digits of hex."""
    return uuid.uuid4().hex[:16]


class Kept:
    """Sums of flights in which nothing was missing.

    Args:
        sums: of any accelerometers.
    """

    def __init__(self, sums: Iterable[SavedEngine] = ()) -> None:
        self._sums: dict[int, list[SavedEngine]] = {}
        self._add(sums)

    def __iter__(self) -> Iterator[SavedEngine]:
        """All of them."""
        return (saved for its in self._sums.values() for saved in its)

    def take(self, sums: Iterable[SavedEngine], missing: dict[int, bool]) -> None:
        """Take what a flight ended with.

        Args:
            sums: of every accelerometer, with those that it had not decided on.
            missing: whether physics was, by accelerometer that was judged; others stay as they are.
        """
        for imu in missing:
            self._sums.pop(imu, None)
        self._add(s for s in sums if missing.get(s.imu) is False)

    def wait_beside(self, calibrator: Calibrator) -> None:
        """Have a calibrator's flights decide on them, but for what it has learned itself."""
        for saved in self:
            calibrator.earlier.wait_with(saved)

    def _add(self, sums: Iterable[SavedEngine]) -> None:
        for saved in sums:
            self._sums.setdefault(saved.imu, []).append(saved)
