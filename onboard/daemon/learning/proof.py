"""The flight after a push, learned by an estimator of its own: it has to judge the push."""

from __future__ import annotations

from collections.abc import Iterable

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Calibration
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import ParameterValue, Sample, VehicleState


class ProofFlight:
    """Learns what is flown between arming and disarming, and nothing else."""

    def __init__(self, settings: CalibratorSettings) -> None:
        self._settings = settings
        self._calibrator: Calibrator | None = None
        self._armed = False

    def drop(self) -> None:
        """No push waits for a flight, or another board is there."""
        self._calibrator = None

    def feed(
        self, sample: Sample, parameters: Iterable[ParameterValue]
    ) -> dict[int, Calibration] | None:
        """Take a sample; the answers, when the flight ends.

        Args:
            sample: in the order of arrival.
            parameters: all that are known, for the beginning of a flight.
        """
        ended = False
        if isinstance(sample, VehicleState) and sample.armed is not None:
            if sample.armed and not self._armed and self._calibrator is None:
                self._calibrator = Calibrator(self._settings)
                for parameter in parameters:
                    self._calibrator.feed(parameter)
            ended = self._armed and not sample.armed
            self._armed = sample.armed
        if self._calibrator is None:
            return None
        if ended or self._armed or type(sample) is ParameterValue:
            self._calibrator.feed(sample)
        return answers(self._calibrator) if ended else None


def answers(calibrator: Calibrator) -> dict[int, Calibration]:
    """What is known of each accelerometer that was heard enough of."""
    known = {}
    for imu in calibrator.imus:
        try:
            known[imu] = calibrator.calibration(imu)
        except KeyError:
            continue
    return known
