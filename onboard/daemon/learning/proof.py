"""The flight after a push, learned by an estimator of its own: it has to judge the push."""

from __future__ import annotations

from collections.abc import Collection

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Calibration
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.airborne import Ground
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import ParameterValue, Sample, VehicleState
from onboard.daemon.learning.meaning import carried, hand_on


class ProofFlight:
    """Learns what is flown between arming and disarming, and nothing else."""

    def __init__(self, settings: CalibratorSettings) -> None:
        self._settings = settings
        self._calibrator: Calibrator | None = None
        self._ground = Ground()
        self._waiting: frozenset[str] = frozenset()

    def expect(self, waiting: Collection[str]) -> None:
        """These pushes wait for a flight: what was flown before one of them came is forgotten.

        Args:
            waiting: transactions.
        """
        before, self._waiting = self._waiting, frozenset(waiting)
        if not self._waiting or self._waiting - before:
            self.drop()

    def drop(self) -> None:
        """What was flown is forgotten: no push waits for it, or another board is there."""
        self._calibrator = None

    def feed(self, sample: Sample, parameters: ParametersInForce) -> dict[int, Calibration] | None:
        """Take a sample; the answers, when the flight ends.

        Args:
            sample: in the order of arrival.
            parameters: in force, for the beginning of a flight.
        """
        ended = False
        if isinstance(sample, VehicleState):
            before, self._ground = self._ground, self._ground.after(sample)
            if self._ground.armed and not before.armed and self._calibrator is None:
                self._calibrator = Calibrator(self._settings)
                hand_on(carried(parameters), self._calibrator)
            ended = bool(before.armed) and not self._ground.armed
        if self._calibrator is None:
            return None
        if ended or self._ground.armed or type(sample) is ParameterValue:
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
