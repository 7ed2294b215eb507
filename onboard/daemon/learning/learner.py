"""The learner: samples in, calibrations out; its sums survive the process.

It lives on the worker's thread and is only called there; what it gives back is frozen.  It
knows no link.

**Gaps.**  While the service is off, or the autopilot reboots or is silent, somebody can change the
board for another one or calibrate it on a bench.  After each gap :meth:`Learner.identify` is told
who answers.  What the same board (by its own word) with the same sensors and values has been judged
to need still holds; of everything else what was proposed waits for a flight or a person.

**Sums.**  What a flight has taught is diagnosed after the landing
(:mod:`onboard.daemon.learning.examiner`).  Only sums that passed it are kept, on disk and over a
boot of the autopilot, and each flight after a boot learns from nothing: sums of before wait until
it agrees with them, for a sensor may have changed without anybody saying so.  Where physics was
missing that moves the numbers, the sums are forgotten at once: they are known to be wrong and must
not be added to those of a flight that is right.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

import msgspec

from onboard.answers.knowledge import whole
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.events import Advanced, FlightEnded, Restarted
from onboard.core.estimate.result import Calibration, Status
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.gps.distrust import WindowClosed, WindowOpened
from onboard.core.inputs.samples import ParameterValue, Sample
from onboard.daemon.learning import limits
from onboard.daemon.learning.examiner import Examined, Examiner
from onboard.daemon.learning.flight import JudgedFlight, known_now
from onboard.daemon.learning.heap import trim
from onboard.daemon.learning.identity import Identity
from onboard.daemon.learning.kept import Kept, calibrator_anew, name_of_a_flight
from onboard.daemon.learning.learned import Learned, News
from onboard.daemon.learning.meaning import (
    Meaning,
    carried,
    hand_on,
    matters,
    meanings,
    same_sensors,
)
from onboard.daemon.learning.opening import Opening
from onboard.daemon.learning.proof import ProofFlight, answers
from onboard.daemon.learning.shelf import Shelf
from onboard.daemon.learning.store import Store
from onboard.daemon.view.trust import trust_view
from onboard.errors import StateError


class Learner:
    """Feeds the calibrator and keeps its sums on disk, by board.

    Args:
        store: the disk.
        settings: of the estimator.
        clock: monotonic, s.
        wall_clock: Unix time, s.
    """

    def __init__(
        self,
        store: Store,
        settings: CalibratorSettings,
        *,
        clock: Callable[[], float],
        wall_clock: Callable[[], float],
    ) -> None:
        self._shelf = Shelf(store)
        self._settings = settings
        self._clock = clock
        self._wall_clock = wall_clock
        self._identity: Identity | None = None
        self._before_gap: dict[int, Meaning] = {}
        self._calibrator = calibrator_anew(settings)
        self._kept = Kept()
        self._proof = ProofFlight(settings)
        self._flown: dict[int, Calibration] = {}
        self._examiner = Examiner(clock, wall_clock)
        self._flight: JudgedFlight | None = None
        self._in_air = False
        self._unjudged = False
        self._windows = 0
        self._opening = Opening()
        self._answers: dict[int, Calibration] = {}
        self._calibrated: dict[int, bool] = {}
        self._stuck: dict[int, float] = {}
        self._stale = self._urgent = False
        self._next_solution = 0.0
        self._counters: Counter[str] = Counter()
        self._news: list[News] = []

    # Who is there

    def identify(self, there: Identity, told: Sequence[ParameterValue] = ()) -> None:
        """An autopilot is there, for the first time or after a gap.

        Args:
            there: who it is.
            told: the parameters that it has told since.
        """
        before, self._identity = self._identity, there
        self._examiner.autopilot, self._examiner.board = there.autopilot, there.board
        same = before is not None and there.surely(before)
        # Of another board, for all that is known, nothing holds any more.
        values = carried(self._calibrator.parameters) if same or before is None else {}
        values |= {parameter.name: parameter.value for parameter in told if matters(parameter.name)}
        if same and same_sensors(self._before_gap, meanings(values)):
            return
        maybe = before is not None and not there.surely_not(before)
        calibrator, kept = calibrator_anew(self._settings), self._flight if maybe else None
        if maybe:
            self._end_in_the_air()
            self._kept.wait_beside(calibrator)
        if before != there and not same:
            if before is not None:
                self._shelve(before)
                self._tell_of_another(before, there)
            loaded = self._take_from_shelf(calibrator)
            kept = kept or loaded
        self._kept = Kept(calibrator.sums)
        self._begin(calibrator, values, forgotten=not maybe)
        self._flight = None if kept is None else kept.outdated()
        if calibrator.waiting:
            text = "what was learned before is added when a flight agrees with it"
            self._tell("state_resumed", text)

    def gap(self, *, rebooted: bool = False) -> None:
        """The autopilot rebooted (unseen by its samples) or was silent: it may be another board."""
        for event in self._calibrator.restart("reboot") if rebooted else ():
            self._note(event)
        self._before_gap = meanings(self._calibrator.parameters.values)

    def _tell_of_another(self, before: Identity, there: Identity) -> None:
        """Nothing that was shown a moment ago is of this one: that is not to look like a fault."""
        if there.surely_not(before):
            text = (
                f"another board answers as system {there.system_id}: what was learned of the one "
                "before is kept for that one, a flight that it has not ended is not"
            )
            self._tell("another_board", text, warning=True)

    def _take_from_shelf(self, calibrator: Calibrator) -> JudgedFlight | None:
        """Lay what is on the disk beside this calibrator; the last flight that was judged."""
        if self._identity is None:
            return None
        try:
            flight = self._shelf.load(self._identity, calibrator)
        except StateError as error:
            self._tell("state_refused", f"starting from nothing: {error}", warning=True)
            return None
        if self._shelf.lost_s >= 1.0:
            text = (
                f"{self._shelf.lost_s:.0f} s of flight were not diagnosed before the service, or "
                "the power, went: nothing of that is kept; after a landing leave both on"
            )
            self._tell("flight_lost", text, warning=True)
        return flight

    def _shelve(self, whose: Identity) -> None:
        """Before another board takes over; a disk that does not take it costs that board's sums."""
        try:
            self._save(whose, self._wall_clock())
        except StateError as error:
            self._tell("save_failed", str(error), warning=True)

    def _begin(
        self, calibrator: Calibrator, parameters: Mapping[str, float], *, forgotten: bool
    ) -> None:
        """Go on with another calibrator, which is told what the messages mean.

        Args:
            calibrator: has flown nothing.
            parameters: in force.
            forgotten: nothing that was flown before counts any more.
        """
        self._calibrator = calibrator
        hand_on(parameters, calibrator)
        if forgotten:
            self._examiner.begin_anew(calibrator)
        else:
            self._examiner.go_on_with(calibrator)
        self._calibrated.clear()
        self._stuck.clear()
        self._answers = {}
        self._proof.drop()
        self._opening.restarted()
        self._in_air = self._unjudged = False
        self._stale = self._urgent = True

    # What comes in

    def learn(
        self, samples: Iterable[Sample], *, judging: Collection[str], in_flight: bool = False
    ) -> Learned:
        """Take a batch.

        Args:
            samples: in the order in which they came.
            judging: pushes that wait for the verdict of a flight, by transaction.
            in_flight: values may be written in flight, so diagnose there, too.
        """
        self._proof.expect(judging)
        for sample in samples:
            if type(sample) is ParameterValue:
                self._parameter(sample)
            for event in self._calibrator.feed(sample):
                self._note(event)
            if self._opening.feed(sample):
                self._windows += 1
                self._tell("window_opened", "GPS is trusted: ready to learn in flight")
            if judging:
                flown = self._proof.feed(sample, self._calibrator.parameters)
                self._flown = self._flown if flown is None else flown
        if self._flight is not None:  # forgotten where other sensors say who they are
            self._flight = self._flight.of_these_sensors(self._calibrator.parameters, of_none=True)
        learned = self._learned()
        ready = (c.status is Status.CALIBRATED for c in self._answers.values())
        if in_flight and self._in_air and any(ready):
            self._examiner.flying(self._calibrator)
        return learned

    def examine(self) -> Learned:
        """Diagnose one accelerometer of those that wait for it; takes seconds."""
        trim()  # what the refinement of the flight has left
        if (examined := self._examiner.examine_next()) is not None:
            self._keep(examined)
            self._judged(examined.flight)
            # Another boot may have begun since the landing, or an engine: they know nothing of it.
            self._kept.wait_beside(self._calibrator)
        trim()
        return self._learned()

    def reset(self) -> Learned:
        """Forget everything that was learned, on disk too; the parameters in force stay known.

        Raises:
            StateError: all is forgotten but for what is on the disk, which keeps it.
        """
        values = carried(self._calibrator.parameters)
        self._begin(calibrator_anew(self._settings), values, forgotten=True)
        self._windows = 0
        self._flight, self._kept = None, Kept()
        if self._identity is not None:
            self._shelf.clear(self._identity)
        return self._learned()

    def save(self, saved_at: float) -> None:
        """Write the sums to disk.

        Raises:
            StateError: the disk does not take them.
        """
        if self._identity is not None:
            self._save(self._identity, saved_at)
            trim()

    def _save(self, whose: Identity, saved_at: float) -> None:
        unjudged_s = self._examiner.unjudged_s(self._calibrator) if self._unjudged else 0.0
        self._shelf.save(whose, self._kept, self._flight, saved_at, unjudged_s=unjudged_s)

    def _keep(self, examined: Examined) -> None:
        """Keep sums of what nothing was missing in, and nothing false."""
        for sentence in examined.failed.values():
            self._tell("diagnosis_failed", sentence, warning=True)
        for imu, found in examined.flight.diagnosed.items():
            changed = examined.changed.get(imu)
            if found.missing or changed:
                self._kept.forget(imu)
            elif not found.left_out:
                self._kept.take(imu, examined.sums)
            if changed or (found.left_out and not found.missing):
                # What was left out of the diagnosis is in the sums; those before are as they were.
                self._begin_anew(imu, changed or "something false was in the flight")

    def _begin_anew(self, imu: int, why: str) -> None:
        self._calibrator.begin_anew(imu)
        self._calibrated.pop(imu, None)
        self._stale = self._urgent = True
        self._tell("begun_anew", f"IMU {imu}: learning anew, {why}", warning=True)

    def _judged(self, flight: JudgedFlight) -> None:
        """Take what was said; a flight that says nothing takes nothing away."""
        self._unjudged = False
        taken = flight.after(self._flight)
        if taken is None:
            if flight.imus:  # else it was said that none could be diagnosed
                text = "the flight says too little: what was known before stays"
                self._tell("flight_too_short", text)
            return
        self._flight = taken
        for imu, found in flight.diagnosed.items():
            if found.missing:
                self._begin_anew(imu, "physics was missing")

    # What goes out

    def _learned(self) -> Learned:
        self._solve()
        self._tell_of_stuck()
        news, self._news = tuple(self._news), []
        flown, self._flown = self._flown, {}
        trust = trust_view(self._calibrator.trust, told=self._opening.told, windows=self._windows)
        parameters = self._calibrator.parameters
        flight = None if self._flight is None else self._flight.of_these_sensors(parameters)
        return Learned(
            calibrations=known_now(flight, self._answers, parameters, unjudged=self._unjudged),
            trust=msgspec.structs.replace(trust, trusted_s=self._calibrator.flown_s),
            counters={**self._counters, **self._shelf.counters, **self._examiner.counters},
            news=news,
            flown=flown,
            flight=None if self._unjudged else flight,
            diagnosing=self._examiner.waiting,
            flying=self._in_air and parameters.armed is not False,
        )

    def _solve(self) -> None:
        """Solve anew if something has come to it, and not too often unless it is urgent."""
        began = self._clock()
        if not self._stale or (began < self._next_solution and not self._urgent):
            return
        self._stale = self._urgent = False
        self._answers = answers(self._calibrator)
        trim()  # what a refinement and the solution have left
        self._next_solution = began + (self._clock() - began) / limits.SOLVING_SHARE
        for imu, answer in self._answers.items():
            if answer.status is Status.CALIBRATED:
                self._tell_of_calibration(imu, answer)
            elif answer.status is Status.INVALID and self._calibrated.pop(imu, None) is not None:
                self._tell("invalid", f"IMU {imu}: {answer.note}", warning=True)

    def _tell_of_calibration(self, imu: int, answer: Calibration) -> None:
        """Once when there is something to set, once when there is no more to learn."""
        all_of_it = whole(answer)
        if imu not in self._calibrated or all_of_it > self._calibrated[imu]:
            self._calibrated[imu] = all_of_it
            more = "" if all_of_it else " in part; fly on for more"
            self._tell("calibrated", f"IMU {imu} is calibrated{more}")

    def _tell_of_stuck(self) -> None:
        """Once for each time that an accelerometer repeats one reading in flight."""
        for imu in self._calibrator.imus:
            times = self._calibrator.stuck(imu)
            if times and times[-1][0] != self._stuck.get(imu):
                self._stuck[imu] = times[-1][0]
                self._tell("imu_stuck", f"IMU {imu} repeats one reading in flight", warning=True)

    # How

    def _note(self, event: object) -> None:
        self._stale = True
        match event:
            case WindowOpened(t):
                self._opening.opened(t)
            case WindowClosed(_, reason):
                if self._opening.closed():
                    why = reason.value.replace("_", " ")
                    self._tell("window_closed", f"GPS is not trusted: {why}")
            case Advanced():
                # What was found of the flight before is not about this one.
                if not self._in_air:
                    self._examiner.took_off(self._calibrator.parameters)
                    self._in_air = self._unjudged = True
                self._counters["event_Advanced"] += 1
            case _:
                if isinstance(event, FlightEnded):
                    self._in_air, self._urgent = False, True
                    self._examiner.landed(self._calibrator, event.t)
                if isinstance(event, Restarted):
                    self._end_in_the_air()
                    self._calibrator.begin_flight(name_of_a_flight())
                    self._kept.wait_beside(self._calibrator)
                    self._opening.restarted()
                self._counters[f"event_{type(event).__name__}"] += 1

    def _end_in_the_air(self) -> None:
        """A flight that ends with the power of the autopilot, or with its link, has ended, too."""
        if self._in_air:
            self._in_air = False
            self._examiner.landed(self._calibrator)

    def _parameter(self, told: ParameterValue) -> None:
        """Solve anew where a value changes what the messages mean."""
        if matters(told.name) and self._calibrator.parameters.values.get(told.name) != told.value:
            self._stale = self._urgent = True

    def _tell(self, kind: str, text: str, *, warning: bool = False) -> None:
        self._news.append(News(kind, text, warning))
