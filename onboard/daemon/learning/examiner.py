"""The examiner: has every flight diagnosed before anything of it may be written.

It lives on the learner's thread.  A diagnosis goes several times over the flight and costs some
seconds: it is made after the landing, one accelerometer at a time, so that what comes over the
link is taken in between.  The flight is frozen when it ends, so that all of its accelerometers are
judged on the same samples however long that takes, and what was found is handed out only when all
of them are.  Where small steps may be written in flight it is made in flight, too, as seldom as the
budget asks.

Flights of one boot are learned together.  An accelerometer that was changed between two of them, on
the ground, looks like one whose offset has jumped: if it jumped about when nobody flew, what was
flown since is diagnosed by itself, and if nothing is missing in that, it is what counts.
"""

from __future__ import annotations

import logging
import math
import uuid
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np

from onboard.answers.answer import Answer, answer, diagnosed
from onboard.answers.explain_document import explain_document
from onboard.answers.knowledge import determined
from onboard.answers.together import judged as status_of
from onboard.answers.together import six_are_all
from onboard.core.diagnosis.cleared import since_reboot
from onboard.core.diagnosis.records import Diagnosis, Verdict
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.comparison import compare
from onboard.core.estimate.result import Calibration, Status
from onboard.core.estimate.saving import SavedEngine
from onboard.core.estimate.solution import Solution, solve
from onboard.core.estimate.with_others import with_others
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.segments import Batch
from onboard.core.maths.accelerometer import parameters_jacobian, parameters_of
from onboard.core.maths.chi_square import CHI_SQUARE_999
from onboard.core.physics.finding import Finding
from onboard.daemon.learning import limits
from onboard.daemon.learning.flight import Judged, JudgedFlight
from onboard.daemon.learning.meaning import Meaning, corrections, in_force, meanings
from onboard.push.diagnosed import Diagnosed
from onboard.push.entries import Support
from onboard.push.watch import preference

logger = logging.getLogger(__name__)

BIAS_STEP = "bias_step"
"""The effect whose moment decides whether it happened in flight."""


@dataclass(slots=True)
class Frozen:
    """A flight under examination: as it was when it ended, and what was found so far."""

    flight: Calibrator
    support: Support
    waiting: list[int]
    at_takeoff: dict[int, Meaning]
    landings: tuple[float, ...] = ()
    current: bool = True
    changed: dict[int, str] = field(default_factory=dict)
    failed: dict[int, str] = field(default_factory=dict)
    imus: dict[int, Judged] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Examined:
    """A flight that was judged, and the sums that it ended with, of every accelerometer.

    ``changed``: accelerometers that are others since one of its landings, and by what that shows;
    ``failed``: those of which no diagnosis could be made, a sentence each.
    """

    flight: JudgedFlight
    sums: tuple[SavedEngine, ...]
    changed: Mapping[int, str]
    failed: Mapping[int, str]


class Examiner:
    """Diagnoses flights, the latest first.

    Args:
        clock: monotonic, s.
        wall_clock: Unix time, s.
    """

    def __init__(self, clock: Callable[[], float], wall_clock: Callable[[], float]) -> None:
        self.autopilot = "ardupilot"
        self.board = ""
        self.counters: Counter[str] = Counter()
        self._clock = clock
        self._wall_clock = wall_clock
        self._frozen: Frozen | None = None
        self._judged_s = 0.0
        self._at_takeoff: dict[int, Meaning] = {}
        self._landings: list[float] = []
        self._not_before = -np.inf

    def took_off(self, parameters: ParametersInForce) -> None:
        """A flight begins: these are the values that it is flown with, unless they are changed."""
        self._at_takeoff = meanings(parameters.values)

    @property
    def waiting(self) -> tuple[int, ...]:
        """Accelerometers of the flight under examination: none is judged before all are."""
        return () if self._frozen is None else tuple(self._frozen.flight.imus)

    def unjudged_s(self, flight: Calibrator) -> float:
        """Seconds of what was flown that no diagnosis has been made of."""
        frozen = 0.0 if self._frozen is None else self._frozen.support.trusted_s
        return max(frozen, flight.flown_s - self._judged_s)

    def landed(self, flight: Calibrator, at: float | None = None) -> None:
        """A flight has ended; nothing is to be said of being armed without having flown.

        Args:
            flight: what was flown, of all flights since the clock began.
            at: when it was disarmed, boot clock, s; None: the clock begins anew.
        """
        if at is None:
            self._landings.clear()
        else:
            self._landings.append(at)
        if flight.flown_s > self._judged_s:
            self._freeze(flight)
            self._judged_s = flight.flown_s

    def flying(self, flight: Calibrator) -> None:
        """In flight, and some of it could be written now, if it were diagnosed."""
        if self._frozen is None and self._clock() >= self._not_before:
            self._freeze(flight)

    def begin_anew(self, flight: Calibrator) -> None:
        """What was learned is of another board, or was reset: nothing of it is judged."""
        self._frozen = None
        self._landings.clear()
        self._judged_s = flight.flown_s

    def go_on_with(self, flight: Calibrator) -> None:
        """What is learned from here on may be of another board: what is under examination, too."""
        if self._frozen is not None:
            self._frozen.current = False
        self._landings.clear()
        self._judged_s = flight.flown_s

    def examine_next(self) -> Examined | None:
        """Diagnose one accelerometer; the flight, if that was the last one of it."""
        frozen = self._frozen
        if frozen is None:
            return None
        began = self._clock()
        if frozen.waiting:
            self._examine(frozen, frozen.waiting.pop(0))
            self._not_before = began + (self._clock() - began) / limits.IN_FLIGHT_SHARE
        if frozen.waiting:
            return None
        self._frozen = None
        flight = JudgedFlight(frozen.support, _with_each_other(frozen), frozen.current)
        return Examined(flight, tuple(frozen.flight.sums), frozen.changed, frozen.failed)

    def _freeze(self, flight: Calibrator) -> None:
        trusted_s = flight.flown_s - self._judged_s
        support = Support(uuid.uuid4().hex, self._wall_clock(), self.board, trusted_s)
        frozen = flight.frozen()
        self._frozen = Frozen(
            frozen, support, list(frozen.imus), dict(self._at_takeoff), tuple(self._landings)
        )

    def _examine(self, frozen: Frozen, imu: int) -> None:
        flight = frozen.flight
        self.counters["diagnoses"] += 1
        device_id = flight.parameters.device_id(imu)
        values = flight.parameters.values
        before = frozen.at_takeoff.get(imu, Meaning())
        six = before.six or in_force(values, imu)
        if device_id is None or six is None:
            self.counters["diagnosis_of_unknown"] += 1
            return
        try:
            given, since = self._answer(frozen, imu)
            document = msgspec.to_builtins(self._document(flight, given.diagnosis, since))
            found = diagnosed(given, document)
        except (ArithmeticError, LookupError, ValueError) as error:  # numbers no model fits
            self.counters["diagnosis_failed"] += 1
            logger.exception("IMU %d: the flight could not be diagnosed", imu)
            why = f"nothing of it is written ({type(error).__name__}: {error})"
            frozen.failed[imu] = f"IMU {imu}: the flight could not be diagnosed: {why}"
            return
        if imu in frozen.changed:
            found = replace(found, calibration=_alone(found.calibration))
        else:
            found = with_earlier(flight, found)
        corrected = before.corrections or corrections(values, imu)
        frozen.imus[imu] = Judged(device_id, six, found, corrected)

    def _answer(self, frozen: Frozen, imu: int) -> tuple[Answer, float]:
        """What is found of one accelerometer, and from when on the flight is that it is about."""
        given, flight = answer(frozen.flight, imu, latest=True), frozen.flight
        jump = next((e for e in given.diagnosis.effects if e.name == BIAS_STEP), None)
        batches = since_reboot(flight.engine(imu).batches)
        since = None if jump is None else changed_on_the_ground(jump, batches, frozen.landings)
        if jump is None or since is None:
            return given, -math.inf
        alone = answer(flight, imu, latest=True, since=since)
        if alone.missing or alone.diagnosis.verdict is Verdict.INSUFFICIENT:
            return given, -math.inf
        by = math.hypot(*(jump.unknowns[axis].value for axis in "xyz"))
        frozen.changed[imu] = (
            f"it has changed by {by:.2g} m/s² between two flights, on the ground: see to its mount"
        )
        return alone, since

    def _document(self, flight: Calibrator, found: Diagnosis, since: float) -> msgspec.Struct:
        batches = since_reboot(flight.engine(found.imu).batches, since)
        return explain_document(
            found,
            files=(),
            autopilot=self.autopilot,
            duration_s=sum(c.duration for c in batches),
            samples={
                "imu": sum(len(c.segment.t) for c in batches),
                "gps": sum(len(c.fixes) for c in batches),
            },
        )


def changed_on_the_ground(
    jump: Finding, batches: Sequence[Batch], landings: Sequence[float]
) -> float | None:
    """When the flight began before which the offset jumped, s; None if it did so in the air.

    Args:
        jump: its time is since the first sample of the flight.
        batches: the flight.
        landings: when the vehicle was disarmed, s.
    """
    at = float(batches[0].segment.t[0]) + jump.unknowns["time"].value
    for landed in landings:
        before = [float(b.fixes.t[-1]) for b in batches if b.fixes.t[0] < landed]
        after = [float(b.fixes.t[0]) for b in batches if b.fixes.t[0] >= landed]
        edge = limits.GROUND_EDGE_S
        if before and after and before[-1] - edge <= at <= after[0] + edge:
            return after[0]
    return None


def _with_each_other(frozen: Frozen) -> dict[int, Judged]:
    """What was found of each accelerometer, with what the others add to it.

    One that was changed between two flights did not fly all of it with the others.
    """
    flight, judged = frozen.flight, frozen.imus
    found = {imu: j.diagnosed for imu, j in judged.items() if imu not in frozen.changed}
    those = [
        d.calibration for d in found.values() if six_are_all(d.calibration, d.missing, d.effects)
    ]
    if len(those) < 2:
        return judged
    flown = {c.imu: since_reboot(flight.engine(c.imu).batches) for c in those}
    try:
        comparison = compare(those, (flown,))
        known = {} if comparison is None else with_others(those, comparison)
    except (ArithmeticError, ValueError):  # numbers that no model fits
        return judged
    needs = flight.settings.needs
    out = dict(judged)
    for imu, c in known.items():
        calibration = status_of(c, needs)
        out[imu] = replace(out[imu], diagnosed=replace(found[imu], calibration=calibration))
    return out


def _alone(c: Calibration) -> Calibration:
    note = f"of what was flown since the accelerometer was changed on the ground. {c.note}"
    return replace(c, note=note.rstrip())


def with_earlier(flight: Calibrator, found: Diagnosed) -> Diagnosed:
    """With the answer of all flights, where that says more than this one, which supports it.

    Support is the flight's own: by its likelihood alone it must prefer those values to the ones in
    force, past the 0.999 quantile of what six numbers that change nothing gain by chance.
    """
    alone, engine = found.calibration, flight.engine(found.imu)
    if found.missing or not engine.aged or _contradicts(alone, solve(engine.aged, engine.model)):
        return found
    together = flight.calibration(found.imu)
    if together.status is not Status.CALIBRATED or _directions(together) <= _directions(alone):
        return found
    gain = preference(
        np.array(together.in_force_scale + together.in_force_offset),
        np.array(together.scale + together.offset),
        alone,
    )
    if gain is None or gain < CHI_SQUARE_999[6]:
        return found
    return replace(found, calibration=_added(together))


def _contradicts(alone: Calibration, before: Solution) -> bool:
    """Whether a flight's own answer is no chance beside that of what was flown before it.

    Past the 0.999 quantile of chi-square, as for sums that were saved.
    """
    six = np.array(alone.scale + alone.offset)
    turn = parameters_jacobian(before.theta[:6])
    apart = six - np.array(parameters_of(before.theta[:6]))
    both = np.array(alone.covariance) + turn @ before.covariance[:6, :6] @ turn.T
    return not float(apart @ np.linalg.solve(both, apart)) <= CHI_SQUARE_999[6]


def _directions(c: Calibration) -> int:
    """Of the six, how many can be set."""
    found = determined(c) if c.status is Status.CALIBRATED else None
    return 0 if found is None else found.directions


def _added(together: Calibration) -> Calibration:
    note = f"together with flights before this one, which agrees with them. {together.note}"
    return replace(together, note=note.rstrip())
