"""A flight that was judged: what every accelerometer's diagnosis said of the same samples.

It is what a push rests on, so it carries what decides whether it still means anything: which
board it was flown on, with which values in force, and whether that was since the service and the
autopilot last started.  Identifiers of accelerometers (INS_ACCn_ID) are the same on every board of
one model; they only rule sensors out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import msgspec

from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.engines import NO_SENSOR
from onboard.core.estimate.result import Calibration, Six, Status
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.maths.accelerometer import parameter_names
from onboard.core.physics.catalogue import bearing_of
from onboard.core.physics.effect import Bearing
from onboard.daemon.learning.meaning import corrected_otherwise, corrections, in_force
from onboard.mavlink.parameter_messages import to_float32
from onboard.push.diagnosed import Diagnosed
from onboard.push.entries import Support


@dataclass(frozen=True, slots=True)
class Judged:
    """One accelerometer of a flight: its identifier, the six in force at take-off, the diagnosis.

    ``in_force`` are float32, in the order of ``parameter_names(imu).six``; ``corrections`` are
    parameters of its correction for temperature, by name.
    """

    device_id: float
    in_force: Six
    diagnosed: Diagnosed
    corrections: Mapping[str, float] = field(default_factory=dict)

    def changed_since(self, now: Mapping[str, float], imu: int, written: Sequence[float]) -> str:
        """What somebody has changed of what raw values mean, in words; empty if nothing.

        Args:
            now: parameters in force.
            imu: number of the accelerometer.
            written: the six as we have written them since, or empty.
        """
        corrected = corrected_otherwise(self.corrections, corrections(now, imu))
        if corrected:
            return ", ".join(corrected)
        six, then = in_force(now, imu), tuple(written) or self.in_force
        if six is None or six in (self.in_force, then):
            return ""
        names = parameter_names(imu).six
        return ", ".join(
            f"{name} from {old:.6g} to {new:.6g}"
            for name, old, new in zip(names, then, six, strict=True)
            if new != old
        )


@dataclass(frozen=True, slots=True)
class JudgedFlight:
    """A flight whose accelerometers were all diagnosed.

    ``current``: it was flown since the service and the autopilot last started, on a board that has
    been there all the time as far as it tells.
    """

    support: Support
    imus: Mapping[int, Judged] = field(default_factory=dict)
    current: bool = True

    @property
    def diagnosed(self) -> dict[int, Diagnosed]:
        """What was found, by accelerometer."""
        return {imu: judged.diagnosed for imu, judged in self.imus.items()}

    @property
    def says_nothing(self) -> bool:
        """Whether it neither calibrates nor doubts any of its accelerometers: short, or quiet."""
        return not any(
            found.missing or found.calibration.status is Status.CALIBRATED
            for found in self.diagnosed.values()
        )

    def after(self, before: JudgedFlight | None) -> JudgedFlight | None:
        """It in the place of an earlier flight; None if it says too little to take it.

        Of an accelerometer that it could not have shown to be as the earlier flight has found it,
        that finding, for which it was withheld, stays.
        """
        if before is None:
            return self
        kept = {
            imu: before.imus[imu]
            for imu, found in self.diagnosed.items()
            if not _would_have_shown(found, before.diagnosed.get(imu))
        }
        if self.says_nothing or len(kept) == len(self.imus):
            return None
        return replace(self, imus={**self.imus, **kept})

    def outdated(self) -> JudgedFlight:
        """The same after a gap in which the board may have been changed for another."""
        return replace(self, current=False)

    def of_these_sensors(
        self, parameters: ParametersInForce, *, of_none: bool = False
    ) -> JudgedFlight | None:
        """Without what is about accelerometers with other identifiers; None: nothing is left.

        Args:
            parameters: in force.
            of_none: keep what is about one in whose place none is named now.  One that was not
                found at this boot may be at the next: nothing of it holds, and nothing is lost.
        """
        none = {NO_SENSOR} if of_none else set[float]()
        there = {
            imu: judged
            for imu, judged in self.imus.items()
            if parameters.device_id(imu) in {None, judged.device_id, *none}
        }
        return replace(self, imus=there) if there else None


def _would_have_shown(found: Diagnosed, before: Diagnosed | None) -> bool:
    """Whether a flight could have shown what an earlier one was withheld for.

    An antenna does not move to its place because a hover cannot see where it is.  What held for
    the earlier flight alone, a jump or a drift, is gone with it.
    """
    if before is None or not before.missing or found.missing:
        return True
    if found.verdict == Verdict.INSUFFICIENT.value:
        return False
    lasting = {e for e in before.effects if bearing_of(e) in (Bearing.BESIDE, Bearing.WITHIN)}
    return not lasting & {n["name"] for n in found.document.get("not_testable", ())}


def compared_now(then: Calibration, live: Calibration | None, now: Six) -> Calibration:
    """The calibration of a flight, compared with the values in force now.

    Args:
        then: as it was diagnosed.
        live: the estimator's own answer, which knows the residual with the values in force now.
        now: the six in force.
    """
    scale, offset = now[:3], now[3:]
    if (*map(to_float32, (*then.in_force_scale, *then.in_force_offset)),) == now:
        return then
    nan = float("nan")
    return replace(
        then,
        in_force_scale=scale,
        in_force_offset=offset,
        parameters_known=then.parameters_known if live is None else live.parameters_known,
        whitened_rms_before=nan if live is None else live.whitened_rms_before,
        held_out_before=nan if live is None else live.held_out_before,
        velocity_rms_before=nan if live is None else live.velocity_rms_before,
        predictive_gain=nan if live is None else live.predictive_gain,
    )


def known_now(
    flight: JudgedFlight | None,
    answers: Mapping[int, Calibration],
    parameters: ParametersInForce,
    *,
    unjudged: bool,
) -> dict[int, Calibration]:
    """What is known of each accelerometer: as its flight was judged, or as it is estimated since.

    Args:
        flight: the last one that was judged, None if none was.
        answers: the estimator's own.
        parameters: in force now.
        unjudged: a flight has begun since, of which the estimator knows more.
    """
    judged = {}
    for imu, found in (flight.diagnosed if flight else {}).items():
        now = in_force(parameters.values, imu)
        if now is not None:
            judged[imu] = compared_now(found.calibration, answers.get(imu), now)
    both = {**judged, **answers} if unjudged else {**answers, **judged}
    return dict(sorted(both.items()))


def encode(flight: JudgedFlight) -> bytes:
    """For the disk."""
    return msgspec.msgpack.encode(flight)


def decode(data: bytes) -> JudgedFlight | None:
    """From the disk: nothing flown since; None if another version wrote it differently."""
    try:
        flight = msgspec.msgpack.decode(data, type=JudgedFlight)
    except (msgspec.DecodeError, ValueError, RecursionError):
        return None
    told = {
        imu: replace(judged, diagnosed=replace(judged.diagnosed, resumed=True))
        for imu, judged in flight.imus.items()
    }
    return replace(flight, imus=told, current=False)
