"""The learner: messages in, calibrations out; its sums survive the process.

One per daemon.  It knows no link and no clock: the service hands it messages, tells it when a
vehicle was found, and asks it to save.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Iterable

from onboard import __version__
from onboard.core.calibrator import Calibrator
from onboard.core.result import Calibration, Status
from onboard.core.samples import ParameterValue, Sample
from onboard.core.settings import EstimatorSettings
from onboard.core.trust import WindowClosed, WindowOpened
from onboard.daemon.notices import Notices
from onboard.daemon.store import Store
from onboard.errors import StateError
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import Message

KEPT_PARAMETERS = ("INS", "AHRS", "GPS", "ARMING")


class Learner:
    """Feeds the calibrator and keeps its sums on disk, by vehicle."""

    def __init__(self, store: Store, settings: EstimatorSettings, notices: Notices) -> None:
        self._store = store
        self._settings = settings
        self._notices = notices
        self._calibrated: set[int] = set()
        self._system_id: int | None = None
        self._device_ids: dict[str, float] = {}
        self._restored_ids: dict[str, float] = {}
        self._parameters: dict[str, ParameterValue] = {}
        self.calibrator = Calibrator(settings)
        self.decoder = Decoder()
        self.windows = 0
        self.counters: Counter[str] = Counter()

    def adopt(self, system_id: int, component_id: int) -> None:
        """An autopilot was found: go on from what was saved for this vehicle."""
        self._system_id = system_id
        self.decoder = Decoder(system_id, component_id)
        self._device_ids = {}
        self._parameters = {}
        self.calibrator = Calibrator(self._settings)
        try:
            saved = self._store.load(system_id)
            if saved is None:
                return
            self.calibrator = Calibrator.from_bytes(saved.sums, self._settings)
        except StateError as error:
            self.counters["state_refused"] += 1
            self._notices.post("state_refused", f"starting from nothing: {error}", warning=True)
            return
        self._restored_ids = saved.device_ids
        self.counters["state_resumed"] += 1
        text = f"resumed what was learned of system {system_id} before"
        self._notices.post("state_resumed", text)

    def take(self, message: Message) -> tuple[Sample, ...]:
        """Decode a message and learn from it; the samples that were in it."""
        samples = self.decoder.decode(message)
        for sample in samples:
            if type(sample) is ParameterValue:
                self._parameter(sample)
            for event in self.calibrator.feed(sample):
                self._note(event)
        return samples

    @property
    def parameters(self) -> Iterable[ParameterValue]:
        """What the autopilot has said of the parameters that matter to an estimator."""
        return self._parameters.values()

    def calibrations(self) -> dict[int, Calibration]:
        """The answer now, by accelerometer."""
        answers = {imu: self.calibrator.calibration(imu) for imu in self.calibrator.imus}
        for imu, answer in answers.items():
            if answer.status is Status.CALIBRATED and imu not in self._calibrated:
                self._calibrated.add(imu)
                self._notices.post("calibrated", f"IMU {imu} is calibrated")
            elif answer.status is Status.INVALID and imu in self._calibrated:
                self._calibrated.discard(imu)
                self._notices.post("invalid", f"IMU {imu}: {answer.note}", warning=True)
        return answers

    def reset(self) -> None:
        """Forget everything that was learned, on disk too; the parameters in force stay known."""
        self.calibrator = Calibrator(self._settings)
        for parameter in self._parameters.values():
            self.calibrator.feed(parameter)
        self._restored_ids = {}
        self._calibrated.clear()
        self.windows = 0
        if self._system_id is not None:
            self._store.path(self._system_id).unlink(missing_ok=True)

    async def save(self, saved_at: float) -> None:
        """Write the sums, on a thread: a memory card may take seconds.

        Raises:
            StateError: the disk does not take them.
        """
        if self._system_id is None:
            return
        await asyncio.to_thread(
            self._store.save,
            self._system_id,
            self.calibrator.to_bytes(),
            version=__version__,
            device_ids=dict(self._device_ids),
            saved_at=saved_at,
        )
        self.counters["saves"] += 1

    def _note(self, event: object) -> None:
        match event:
            case WindowOpened():
                self.windows += 1
                self._notices.post("window_opened", "GPS is trusted: learning")
            case WindowClosed(_, reason):
                text = f"GPS is not trusted: {reason.value.replace('_', ' ')}"
                self._notices.post("window_closed", text)
            case _:
                name = type(event).__name__.lower()
                self.counters[f"event_{name}"] += 1

    def _parameter(self, parameter: ParameterValue) -> None:
        """Keep what a reset must not forget; sums learned on another sensor are worth nothing."""
        name = parameter.name
        if not name.startswith(KEPT_PARAMETERS):
            return
        self._parameters[name] = parameter
        if not (name.startswith("INS") and name.endswith("_ID")):
            return
        self._device_ids[name] = parameter.value
        before = self._restored_ids.get(name, parameter.value)
        if before != parameter.value:
            text = f"{name} was {before:.0f}, is {parameter.value:.0f}: another sensor, begun anew"
            self._notices.post("other_sensor", text, warning=True)
            self.counters["state_of_other_sensor"] += 1
            self.reset()
