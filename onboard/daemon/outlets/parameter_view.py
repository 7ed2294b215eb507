"""The snapshot as ``OBC_*`` parameters, for the parameter view of any ground station.

=================  ==============================================================================
name               meaning
=================  ==============================================================================
``OBC_STATE``      what the service is doing, see :data:`STATES`
``OBC_ADVISE``     1: advise-only, nothing is ever written to this autopilot
``OBC_TRUST``      1: GPS is trusted now
``OBC_DISTRUST``   why it is not, see :data:`REASONS`
``OBC_TRUSTED``    seconds of trusted flight so far, in tens
``OBC_COVERAGE``   coverage of the worst accelerometer, percent
``OBC_PUSH``       policy, **writable**: 0 never, 1 landed, 2 in flight; until the next start
``OBC_APPROVE``    **writable**: 1 approves what waits; returns to 0 when that is done
``OBC_WAITING``    how many accelerometers wait for that approval
``OBC_LATENCY``    how late GPS is, s
``OBC_WINDOW``     averaging span of the GPS receiver, s
``OBC_IMU_DELAY``  how late attitude is stamped against the accelerometer, s
``OBC_FINDING``    the physics that is missing most, see :data:`FINDINGS`
``OBC_n_STAT``     state of accelerometer n, see :data:`STATUSES`
``OBC_n_COV``      its coverage, percent
``OBC_n_SCAL_X``   its scale (Y, Z alike), as ``INS_ACCSCAL_X`` would be
``OBC_n_OFFS_X``   its offset, m/s^2, as ``INS_ACCOFFS_X`` would be
``OBC_n_SS_X``     sigma of that scale; 0: there is no estimate
``OBC_n_SO_X``     sigma of that offset, m/s^2; 0: there is no estimate
=================  ==============================================================================

A number that is not known is 0: stations do not take kindly to NaN, and neither a scale nor a
sigma can be 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from onboard.core.maths.accelerometer import AXES
from onboard.core.physics.catalogue import bearing_of, kinds
from onboard.core.physics.effect import Bearing
from onboard.daemon.view import state
from onboard.daemon.view.snapshot import ImuView, Number, Snapshot, Three

STATES: Final[Mapping[str, int]] = MappingProxyType(
    {
        "no_autopilot": 0,
        "waiting": 1,  # for a GPS that can be trusted
        "learning": 2,
        "calibrated": 3,  # every accelerometer
        "approval": 4,  # something waits for a person
        "writing": 5,
        "stopping": 6,
        "half_written": 7,  # half a set is in force
    }
)

POLICIES: Final = ("never", "landed", "in_flight")
STATUSES: Final[Mapping[str, int]] = MappingProxyType(
    {name: number for number, name in enumerate(state.NAMES, start=1)}
)
"""Numbers of the states of an accelerometer (:mod:`onboard.daemon.view.state`)."""
UNFINISHED: Final = frozenset({"collecting", "insufficient", "invalid"})
REASONS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "spoofed": 1,
        "jammed": 2,
        "no_fix": 3,
        "few_satellites": 4,
        "hdop": 5,
        "speed_accuracy": 6,
        "gps_glitch": 7,
        "ekf_gps_glitch": 8,
        "ekf_unhealthy": 9,
        "stale": 10,
        "gps_gap": 11,
        "restarted": 12,
        "configured_end": 13,
        "end_of_data": 14,
        "ekf_unknown": 15,
        "late": 16,
    }
)

NO_DIAGNOSIS, CLEAN, INSUFFICIENT, UNEXPLAINED, UNKNOWN_EFFECT = -1, 0, 90, 99, 98
FINDINGS: Final[Mapping[str, int]] = MappingProxyType({k.effect: k.code for k in kinds()})
"""Numbers of the effects; -1 no diagnosis yet, 0 nothing is missing, 90 too little flown to say,
98 an effect that this version does not know, 99 something is missing and no effect explains it."""


def parameter_values(snapshot: Snapshot, *, imus: int, approving: bool = False) -> dict[str, float]:
    """All parameters, always the same names in the same order.

    Args:
        snapshot: what there is.
        imus: how many accelerometers get parameters, heard of or not.
        approving: whether an approval is under way.
    """
    known = {imu.imu: imu for imu in snapshot.imus}
    timing = _timing(snapshot)
    coverage = [imu.coverage.percent for imu in snapshot.imus]
    values = {
        "OBC_STATE": float(STATES[_state(snapshot)]),
        "OBC_ADVISE": float(snapshot.mode == "advise_only"),
        "OBC_TRUST": float(snapshot.trust.open),
        "OBC_DISTRUST": float(REASONS.get(snapshot.trust.reason or "", 0)),
        "OBC_TRUSTED": 10.0 * math.floor(snapshot.trust.trusted_s / 10.0),
        "OBC_COVERAGE": float(math.floor(min(coverage, default=0.0))),
        "OBC_PUSH": float(POLICIES.index(snapshot.push.policy)),
        "OBC_APPROVE": float(approving),
        "OBC_WAITING": float(_waiting(snapshot)),
        "OBC_LATENCY": _seconds(timing.get("gps_delay_s")),
        "OBC_WINDOW": _seconds(timing.get("gps_smoothing_window_s")),
        "OBC_IMU_DELAY": _seconds(timing.get("imu_delay_s")),
        "OBC_FINDING": float(finding_number(snapshot.diagnosis)),
    }
    for number in range(1, imus + 1):
        values |= _accelerometer(number, known.get(number))
    return values


def top_effect(diagnosis: Mapping[str, Any] | None) -> Mapping[str, Any] | None:
    """The effect that matters most for what is written, None if there is none.

    One that the calibration lacks comes before those that it has, whatever their shares of the
    mismatch: every receiver is late, and that falsifies nothing.
    """
    effects = (diagnosis or {}).get("effects") or ()
    return max(
        effects,
        key=lambda e: (
            bearing_of(str(e.get("name"))) is not Bearing.HARMLESS,
            e.get("share_of_mismatch") or 0.0,
        ),
        default=None,
    )


def finding_number(diagnosis: Mapping[str, Any] | None) -> int:
    """What :data:`FINDINGS` says about a diagnosis (``onboard.explain/1``)."""
    if diagnosis is None:
        return NO_DIAGNOSIS
    effect = top_effect(diagnosis)
    if effect is not None:
        return FINDINGS.get(str(effect.get("name")), UNKNOWN_EFFECT)
    verdict = diagnosis.get("verdict")
    return {"clean": CLEAN, "insufficient": INSUFFICIENT}.get(str(verdict), UNEXPLAINED)


def _state(snapshot: Snapshot) -> str:
    if snapshot.phase in {"stopping", "stopped"}:
        return "stopping"
    if snapshot.link.system_id is None or snapshot.link.state != "present":
        return "no_autopilot"
    if any(one.half for one in snapshot.push.unfinished):
        return "half_written"
    if snapshot.push.state not in {"idle", "interrupted"}:
        return "writing"
    names = {imu.state.name for imu in snapshot.imus}
    if "approval" in names:
        return "approval"
    if names and not names & UNFINISHED:
        return "calibrated"
    return "learning" if snapshot.trust.open else "waiting"


def _waiting(snapshot: Snapshot) -> int:
    return sum(imu.state.name == "approval" for imu in snapshot.imus)


def _timing(snapshot: Snapshot) -> Mapping[str, Number]:
    """That of the first accelerometer that has any."""
    return next((imu.timing for imu in snapshot.imus if imu.timing), {})


def _accelerometer(number: int, imu: ImuView | None) -> dict[str, float]:
    nothing: Three = (None, None, None)
    c = imu.calibration if imu is not None else None
    rows: tuple[tuple[str, Three, int], ...] = (
        ("SCAL", c.scale if c else nothing, 5),
        ("OFFS", c.offset if c else nothing, 4),
        ("SS", c.scale_sigma if c else nothing, 5),
        ("SO", c.offset_sigma if c else nothing, 4),
    )
    values = {
        f"OBC_{number}_STAT": float(STATUSES.get(imu.state.name, 0)) if imu else 0.0,
        f"OBC_{number}_COV": float(math.floor(imu.coverage.percent)) if imu else 0.0,
    }
    for row, three, digits in rows:
        for axis, value in zip(AXES, three, strict=True):
            # Rounded to what matters, so that the last digits' noise is not announced.
            least = 10.0**-digits if row.startswith("S") and row != "SCAL" else -math.inf
            values[f"OBC_{number}_{row}_{axis}"] = (
                0.0 if value is None else max(least, round(value, digits))
            )
    return values


def _seconds(estimate: Number | None) -> float:
    if estimate is None or estimate.value is None:
        return 0.0
    return round(estimate.value, 3)
