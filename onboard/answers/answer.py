"""One answer for one flight of one accelerometer: what replay, explain and the daemon all give.

A fit of six numbers gives six numbers, whatever physics it lacks.  So the answer is the
diagnosis' own: the numbers of the model with what was found in it, from one set of sums, with one
status.  Found physics forbids what it spoils:

* what is left is not noise: the numbers are wrong by nobody knows how much;
* the six are not the same for all of the flight (a jump, a drift): no one number is right;
* an effect of geometry is modelled beside the six, which keep their meaning: the numbers are
  right, but only as far as the model of it is, and the autopilot still lacks it.  A person decides;
* anything else that moves a number by more than is claimed for it: what the autopilot would do with
  the number is not what the model means by it.

How far an effect moves a number is asked of the same sums without its columns
(:mod:`onboard.core.diagnosis.plain`).  Latency and averaging of the receiver, delay of the attitude
and a wrong heading are in every model: they are worth knowing and forbid nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from onboard.answers.cures import cured
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import REPEATED, Diagnosis, Verdict
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.determined import determine
from onboard.core.estimate.merged_flights import Apart
from onboard.core.estimate.result import SIX_NAMES, Calibration, Status
from onboard.core.physics.catalogue import bearing_of, is_excluded, phrase_of, treated_of
from onboard.core.physics.effect import Bearing
from onboard.push.diagnosed import Diagnosed

FORCES = tuple(f"{axis} force at the mean load" for axis in "xyz")
MOVED_SIGMAS = 2.0
"""Of what is claimed for a number: how far missing physics may move it (5 % move it by chance)."""

DIED = "the accelerometer repeated one reading; see to it before the next flight"
"""Said of one that has an estimate all the same, of before."""

HOLES = "inertial samples are missing: log less, or to a faster card, or over a better link"
"""Said where that took most of a flight."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What is known of one accelerometer from one flight.

    Attributes:
        diagnosis: everything that was found; its calibration has the one status and note.
        missing: why the numbers must not be written by themselves, in words; empty if nothing
            that was found forbids it.
        modelled: what is missing is modelled beside the six, so a person may accept them.
        flights: what it was merged from, one for each recording; empty for a single one.
    """

    diagnosis: Diagnosis
    missing: str = ""
    modelled: bool = False
    flights: tuple[FlightAnswer, ...] = ()

    @property
    def imu(self) -> int:
        """Which accelerometer."""
        return self.diagnosis.imu

    @property
    def calibration(self) -> Calibration:
        """The numbers, their sigmas and their status."""
        return self.diagnosis.calibration


@dataclass(frozen=True, slots=True)
class FlightAnswer:
    """What one of several recordings says of an accelerometer by itself, and what becomes of it.

    Attributes:
        name: of the recording.
        given: its answer; None where the accelerometer did not fly in it.
        apart: its difference from the other flights that count.
        counted: whether it is in the merged answer.
        contradicted: whether it is named for contradicting other flights.
        why: it does not count, in words; empty if it does.
    """

    name: str
    given: Answer | None
    apart: Apart
    counted: bool = False
    contradicted: bool = False
    why: str = ""


def answer(
    calibrator: Calibrator, imu: int, *, latest: bool = False, since: float = -math.inf
) -> Answer:
    """Diagnose a flight and say what may be believed.

    Args:
        calibrator: has the flight; it stays as it is.
        imu: which accelerometer.
        latest: only what is kept since the boot clock last began.
        since: with ``latest``: only what was flown from this time of that clock on, s.

    Raises:
        KeyError: that accelerometer has not been seen, or no flight of it was processed.
        ArithmeticError, LookupError, ValueError: numbers that no model fits.
    """
    found = diagnose(calibrator, imu, latest=latest, since=since)
    return judged(found, calibrator.parameters.values)


def judged(diagnosis: Diagnosis, parameters: Mapping[str, float] | None = None) -> Answer:
    """What a diagnosis means for its calibration: all the rules of status are here.

    Args:
        diagnosis: with the calibration as its engine gave it.
        parameters: the autopilot's, as the recording has them; None: nobody has asked.
    """
    suspects = [e for e in diagnosis.effects if bearing_of(e.name) is not Bearing.HARMLESS]
    if not diagnosis.mismatch.supported:
        return Answer(_refused(diagnosis))
    diagnosis = _with_what_is_missing(_with_what_died(_with_what_was_seen(diagnosis)))
    if diagnosis.verdict in {Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED}:
        found = ", ".join(dict.fromkeys(phrase_of(e) for e in suspects))
        missing = "the residual is not noise, and " + (
            f"what was found ({found}) does not explain all of it"
            if found
            else "no known effect explains it"
        )
        if changing := [c.words for c in diagnosis.inconstant if c.contradicts]:
            missing = "; ".join(changing)
        return _withdrawn(diagnosis, missing)
    bearings = {bearing_of(e.name) for e in suspects}
    if Bearing.NO_ONE_NUMBER in bearings:
        diagnosis = _uncalibrated(diagnosis)
        return _withdrawn(diagnosis, cured(suspects, diagnosis, parameters))
    moved = moved_most(diagnosis) if suspects else None
    if moved is None:
        return Answer(diagnosis)
    name, by, sigmas = moved
    alone = bearings == {Bearing.BESIDE}
    diagnosis = diagnosis if alone else _uncalibrated(diagnosis)
    what = cured(suspects, diagnosis, parameters)
    missing = f"{what} (it moves the {name} by {by:+.2g}, {sigmas:.1f} sigma)"
    if not alone:
        return _withdrawn(diagnosis, missing)
    noted = _noted(diagnosis, f"taken into account beside the six: {missing}")
    return Answer(noted, missing, diagnosis.calibration.status is Status.CALIBRATED)


def moved_most(diagnosis: Diagnosis) -> tuple[str, float, float] | None:
    """The number that what was found moves most: name, by how much, in claimed sigmas.

    None if none that the flight shows moves by more than :data:`MOVED_SIGMAS`.
    """
    plain, fuller = diagnosis.plain, diagnosis.calibration
    if plain is None:
        return None
    by = np.array(fuller.scale + fuller.offset) - np.array(plain.value)
    # The smaller claim: without what was found the blocks may contradict each other, which
    # widens that sigma; with it the columns share what the flight tells.
    claimed = np.minimum(plain.sigma, fuller.sigma_with_its_gyroscope)
    found = determine(fuller, plain.value)
    # An axis of which a combination is known is judged by its force at the mean of its loads.
    six = np.array(plain.value)
    at_load = np.hstack([np.diag(np.array(fuller.load_mean) - six[3:]), -np.diag(six[:3])])
    force_sigma = np.sqrt(np.diag(at_load @ fuller.with_its_gyroscope @ at_load.T))
    moves = np.concatenate([by, at_load @ by])
    counts = np.concatenate([found.known, found.free[:3]])
    sigmas = np.where(counts, np.abs(moves) / np.concatenate([claimed, force_sigma]), 0.0)
    worst = int(np.argmax(sigmas))
    # What is no number is not within its claim.
    if sigmas[worst] <= MOVED_SIGMAS:
        return None
    return (*SIX_NAMES, *FORCES)[worst], float(moves[worst]), float(sigmas[worst])


def diagnosed(given: Answer, document: Mapping[str, Any], *, resumed: bool = False) -> Diagnosed:
    """The answer as it is kept on disk and judged before a push.

    Args:
        given: the answer.
        document: the diagnosis as other programs read it.
        resumed: it was made before the service last started.
    """
    return Diagnosed(
        imu=given.imu,
        verdict=given.diagnosis.verdict.value,
        effects=tuple(e.name for e in given.diagnosis.effects),
        calibration=given.calibration,
        missing=given.missing,
        modelled=given.modelled,
        document=dict(document),
        resumed=resumed,
    )


def _refused(diagnosis: Diagnosis) -> Diagnosis:
    """A diagnosis that no model supports: nor do its numbers say anything, for the same reason."""
    c = replace(diagnosis.calibration, believed=False)
    if c.status is Status.CALIBRATED:
        c = replace(c, status=Status.INSUFFICIENT, note=diagnosis.note or c.note)
    return replace(diagnosis, calibration=c)


def _with_what_was_seen(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis that notes what is false in the data, and forbids nothing: to be seen to."""
    seen = [
        f"{phrase_of(e)}; {treated_of(e.name)}"
        for e in diagnosis.effects
        if is_excluded(e.name) and bearing_of(e.name) is Bearing.HARMLESS
    ]
    if not seen:
        return diagnosis
    return _noted(diagnosis, f"{'; '.join(seen)}; see onboard explain")


def _with_what_died(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis that notes that the accelerometer died in flight: what it was, is right."""
    dead = [u for u in diagnosis.unused if u.reason == REPEATED]
    if not dead:
        return diagnosis
    seconds = sum(u.end_s - u.start_s for u in dead)
    return _noted(diagnosis, f"from {dead[0].start_s:.0f} s on, for {seconds:.0f} s, {DIED}")


def _with_what_is_missing(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis that notes that samples are missing around more fixes than were used."""
    lost = diagnosis.calibration.rejected.get("imu_gap", 0)
    if lost <= diagnosis.mismatch.fixes:
        return diagnosis
    return _noted(diagnosis, f"around {lost} fixes {HOLES}")


def _uncalibrated(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis with a calibration that is not called one."""
    c = diagnosis.calibration
    if c.status is not Status.CALIBRATED:
        return diagnosis
    return replace(diagnosis, calibration=replace(c, status=Status.INSUFFICIENT))


def _withdrawn(diagnosis: Diagnosis, why: str) -> Answer:
    """The answer whose calibration is not called one; ``why`` is noted with it."""
    return Answer(_noted(_uncalibrated(diagnosis), f"{why}; see onboard explain"), why)


def _noted(diagnosis: Diagnosis, said: str) -> Diagnosis:
    c = diagnosis.calibration
    note = f"{said}. {c.note}".rstrip()
    return replace(diagnosis, calibration=replace(c, note=note))
