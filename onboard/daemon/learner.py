"""The learner: samples in, calibrations out; its sums survive the process.

It lives on the worker's thread and is only called there; what it gives back is frozen.  It
knows no link.  While a push waits for the flight that judges it, a second, fresh estimator
learns from what is flown between arming and disarming, and from nothing else: standing on
the ground after a push is no flight.

What a flight has taught is diagnosed after the landing (:mod:`onboard.daemon.examiner`).  Where
physics was missing that moves the numbers, they are forgotten when the next flight begins:
sums that are known to be wrong must not be added to those of a flight that is right.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from onboard import __version__
from onboard.core.calibrator import Calibrator, FlightEnded, Restarted
from onboard.core.result import Calibration, Status
from onboard.core.samples import ParameterValue, Sample, VehicleState
from onboard.core.settings import EstimatorSettings
from onboard.core.trust import WindowClosed, WindowOpened
from onboard.daemon.examiner import Examiner
from onboard.daemon.heap import trim
from onboard.daemon.snapshot import TrustView
from onboard.daemon.store import Kept, Store
from onboard.daemon.view import trust_view
from onboard.errors import StateError
from onboard.push.physics import Diagnosed

SOLVING_SHARE = 0.005
"""Of a core: after a solution that took 0.1 s, the next one is due 20 s later."""
SAME = 1e-6
"""Parameters are float32."""
KEPT_PARAMETERS = ("INS", "AHRS", "GPS", "ARMING")
"""Beginnings of the names that change what an estimator makes of the messages."""


@dataclass(frozen=True, slots=True)
class News:
    """Something that a person should hear of: kind, sentence, and whether it is a warning."""

    kind: str
    text: str
    warning: bool = False


@dataclass(frozen=True, slots=True)
class Learned:
    """Where the learner stands after a batch.

    ``flown`` is the answer of the flight that has just ended, if a push waits for it;
    ``diagnosed`` what the diagnosis of the last flight said, ``diagnosing`` those that wait for
    theirs.
    """

    calibrations: dict[int, Calibration]
    trust: TrustView
    counters: dict[str, int]
    news: tuple[News, ...] = ()
    flown: dict[int, Calibration] = field(default_factory=dict)
    diagnosed: dict[int, Diagnosed] = field(default_factory=dict)
    diagnosing: tuple[int, ...] = ()


class Learner:
    """Feeds the calibrator and keeps its sums on disk, by vehicle; ``clock`` is monotonic, s."""

    def __init__(
        self, store: Store, settings: EstimatorSettings, *, clock: Callable[[], float]
    ) -> None:
        self._store = store
        self._settings = settings
        self._clock = clock
        self._system_id: int | None = None
        self._calibrator = Calibrator(settings)
        self._flight: Calibrator | None = None
        self._flown: dict[int, Calibration] = {}
        self._armed = False
        self._in_flight: bool | None = None
        self._examiner = Examiner(clock)
        self._kept: dict[int, Kept] = {}
        self._windows = 0
        self._parameters: dict[str, ParameterValue] = {}
        self._answers: dict[int, Calibration] = {}
        self._calibrated: set[int] = set()
        self._stale = self._urgent = False
        self._next_solution = 0.0
        self._counters: Counter[str] = Counter()
        self._news: list[News] = []

    def adopt(self, system_id: int, autopilot: str = "ardupilot") -> None:
        """An autopilot was found: go on from what was saved for this vehicle."""
        self._system_id = system_id
        self._examiner.autopilot = autopilot
        try:
            saved = self._store.load(system_id)
            if saved is None:
                return
            self._calibrator = Calibrator.from_bytes(saved.sums, self._settings)
            self._kept = self._store.diagnoses(saved)
        except StateError as error:
            self._counters["state_refused"] += 1
            self._tell("state_refused", f"starting from nothing: {error}", warning=True)
            return
        self._counters["state_resumed"] += 1
        self._tell("state_resumed", f"resumed what was learned of system {system_id} before")

    def learn(
        self, samples: Iterable[Sample], *, judging: bool, in_flight: bool = False
    ) -> Learned:
        """Take a batch.

        Args:
            samples: in the order in which they came.
            judging: a push waits for the verdict of a flight.
            in_flight: values may be written in flight, so diagnose there, too.
        """
        for sample in samples:
            if type(sample) is ParameterValue:
                self._parameter(sample)
            elif type(sample) is VehicleState and sample.armed is not None:
                self._arming(armed=sample.armed)
            for event in self._calibrator.feed(sample):
                self._note(event)
            if judging:
                self._fly(sample)
        if not judging:
            self._flight = None
        self._take_back()
        learned = self._learned()
        if in_flight and self._in_flight:
            ready = (i for i, c in self._answers.items() if c.status is Status.CALIBRATED)
            self._examiner.flying(self._calibrator, ready)
        return learned

    def examine(self) -> Learned:
        """Diagnose one accelerometer of those that wait for it; takes seconds."""
        trim()  # what the refinement of the flight has left
        self._examiner.examine_next(self._calibrator)
        trim()
        return self._learned()

    def reset(self) -> Learned:
        """Forget everything that was learned, on disk too; the parameters in force stay known."""
        self._calibrator = Calibrator(self._settings)
        for parameter in self._parameters.values():
            self._calibrator.feed(parameter)
        self._calibrated.clear()
        self._answers = {}
        self._windows = 0
        self._flight = None
        self._examiner.took_off()
        self._kept.clear()
        self._stale = self._urgent = True
        if self._system_id is not None:
            self._store.path(self._system_id).unlink(missing_ok=True)
        return self._learned()

    def save(self, saved_at: float) -> None:
        """Write the sums to disk.

        Raises:
            StateError: the disk does not take them.
        """
        if self._system_id is None:
            return
        self._store.save(
            self._system_id,
            self._calibrator.to_bytes(),
            version=__version__,
            saved_at=saved_at,
            diagnosed=[*self._kept.values(), *self._to_keep()],
        )
        self._counters["saves"] += 1
        trim()

    def _to_keep(self) -> Iterable[Kept]:
        """The diagnoses that a restart must not lose, by the sensors that they are about."""
        for imu, found in self._examiner.diagnosed.items():
            device_id = self._calibrator.parameters.device_id(imu)
            if device_id is not None:
                yield Kept(device_id, found)

    def _take_back(self) -> None:
        """The diagnoses of before the restart, once it is known that the sensors are those."""
        for imu, kept in tuple(self._kept.items()):
            device_id = self._calibrator.parameters.device_id(imu)
            if device_id is None or not self._calibrator.parameters.known(imu):
                continue
            del self._kept[imu]
            if device_id == kept.device_id:
                self._examiner.diagnosed[imu] = replace(kept.diagnosed, resumed=True)
                self._tell("diagnosis_resumed", f"IMU {imu}: the last flight is diagnosed already")

    def _resumed(self) -> dict[int, Calibration]:
        """Calibrations of before the restart, where nothing has changed since."""
        found = {}
        for imu, diagnosed in self._examiner.diagnosed.items():
            then = diagnosed.calibration
            now = self._calibrator.parameters.six(imu).as_vector()
            in_force = np.array(then.in_force_scale + then.in_force_offset)
            if diagnosed.resumed and np.allclose(now, in_force, rtol=0.0, atol=SAME):
                found[imu] = then
        return found

    def _learned(self) -> Learned:
        self._solve()
        news, self._news = tuple(self._news), []
        flown, self._flown = self._flown, {}
        return Learned(
            calibrations=self._resumed() | self._answers,
            trust=trust_view(self._calibrator.trust, windows=self._windows),
            counters={**self._counters, **self._examiner.counters},
            news=news,
            flown=flown,
            diagnosed=dict(self._examiner.diagnosed),
            diagnosing=self._examiner.waiting,
        )

    def _solve(self) -> None:
        """Solve anew if something has come to it, and not too often unless it is urgent."""
        began = self._clock()
        if not self._stale or (began < self._next_solution and not self._urgent):
            return
        self._stale = self._urgent = False
        self._answers = _answers(self._calibrator)
        self._next_solution = began + (self._clock() - began) / SOLVING_SHARE
        for imu, answer in self._answers.items():
            if answer.status is Status.CALIBRATED and imu not in self._calibrated:
                self._calibrated.add(imu)
                self._tell("calibrated", f"IMU {imu} is calibrated")
            elif answer.status is Status.INVALID and imu in self._calibrated:
                self._calibrated.discard(imu)
                self._tell("invalid", f"IMU {imu}: {answer.note}", warning=True)

    def _arming(self, *, armed: bool) -> None:
        """A flight begins: nothing of it is diagnosed, and what was wrong is not carried on."""
        if armed and not self._in_flight:
            kept = {imu: one.diagnosed for imu, one in self._kept.items()}
            for imu, found in (kept | self._examiner.diagnosed).items():
                if found.missing:
                    self._calibrator.begin_anew(imu)
                    self._calibrated.discard(imu)
                    self._stale = self._urgent = True
                    text = f"IMU {imu}: learning anew, physics was missing in the flight before"
                    self._tell("begun_anew", text)
            self._examiner.took_off()
            self._kept.clear()
        self._in_flight = armed

    def _fly(self, sample: Sample) -> None:
        """Let the judging estimator have what is flown; its answer when the flight ends."""
        if isinstance(sample, VehicleState) and sample.armed is not None:
            if sample.armed and not self._armed and self._flight is None:
                self._flight = Calibrator(self._settings)
                for parameter in self._parameters.values():
                    self._flight.feed(parameter)
            ended = self._armed and not sample.armed
            self._armed = sample.armed
            if ended and self._flight is not None:
                self._flight.feed(sample)
                self._flown = _answers(self._flight)
        if self._flight is not None and (self._armed or type(sample) is ParameterValue):
            self._flight.feed(sample)

    def _note(self, event: object) -> None:
        self._stale = True
        match event:
            case WindowOpened():
                self._windows += 1
                self._tell("window_opened", "GPS is trusted: learning")
            case WindowClosed(_, reason):
                why = reason.value.replace("_", " ")
                self._tell("window_closed", f"GPS is not trusted: {why}")
            case _:
                name = type(event).__name__
                self._urgent |= isinstance(event, FlightEnded)
                # A flight that ends with the power of the autopilot has ended, too.
                if isinstance(event, FlightEnded) or (
                    isinstance(event, Restarted) and self._in_flight
                ):
                    self._examiner.landed(self._calibrator.imus)
                    self._in_flight = False
                self._counters[f"event_{name}"] += 1

    def _parameter(self, parameter: ParameterValue) -> None:
        """Keep what a reset must not forget."""
        name, value = parameter.name, parameter.value
        if not name.startswith(KEPT_PARAMETERS):
            return
        before = self._parameters.get(name)
        if before is None or before.value != value:
            self._stale = self._urgent = True
        self._parameters[name] = parameter

    def _tell(self, kind: str, text: str, *, warning: bool = False) -> None:
        self._news.append(News(kind, text, warning))


def _answers(calibrator: Calibrator) -> dict[int, Calibration]:
    answers = {}
    for imu in calibrator.imus:
        try:
            answers[imu] = calibrator.calibration(imu)
        except KeyError:  # heard, but not enough for any answer yet
            continue
    return answers
