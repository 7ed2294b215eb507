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
        for saved in sums:
            self._sums.setdefault(saved.imu, []).append(saved)

    def __iter__(self) -> Iterator[SavedEngine]:
        """All of them."""
        return (saved for its in self._sums.values() for saved in its)

    def take(self, imu: int, sums: Iterable[SavedEngine]) -> None:
        """What a flight ended with, and what it had not decided on, in the place of those before.

        Args:
            imu: which accelerometer.
            sums: of every accelerometer.
        """
        self._sums[imu] = [saved for saved in sums if saved.imu == imu]

    def forget(self, imu: int) -> None:
        """What was learned of one accelerometer is known to be wrong."""
        self._sums.pop(imu, None)

    def wait_beside(self, calibrator: Calibrator) -> None:
        """Have a calibrator's flights decide on them, but for what it has learned itself."""
        for saved in self:
            calibrator.earlier.wait_with(saved)
