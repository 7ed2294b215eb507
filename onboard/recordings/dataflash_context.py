"""What a converter must know of the whole log before it meets a record: a few small records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.views import tells_views
from onboard.core.vehicle.signals import (
    THROTTLE_FUNCTION,
    primary_airspeed,
    rotor_functions,
)
from onboard.recordings.dataflash_formats import Format, Records
from onboard.recordings.dataflash_index import DataflashIndex

Floats = NDArray[np.float64]
Series = tuple[Floats, Floats]
"""Times (n,) and values (n,)."""

GPS_NAMES = ("GPS", "GPS2")
LONGEST_WAIT_S = 1.0
"""ArduPilot's correction of a message's time takes off half a second at the most (max_lag_ms in
JitterCorrection.h): what is further off is damaged, or of a receiver that has just been found."""
EKF2 = 2.0
ATTITUDE, EKF3_ATTITUDE = "ATT", "XKF1"
CHANNELS = 14


@dataclass(frozen=True, slots=True)
class Context:
    """What a converter must know of the rest of the log.

    Per receiver: ``speed_accuracy`` has the times (n,) and values (n,) of the GPA records, which
    follow the GPS record that they belong to; ``message_time`` the like for the time from which the
    EKF counts back (SMS, s); ``written_late`` is how much later records are written on the average,
    s; ``vertical_speed`` says whether it
    measures one; ``ekf_status_from`` names the record of the EKF that flies; ``motor_channels`` are
    the outputs to take for throttle where the log has no better, ``motor_range_us`` their pulse
    widths at none and at full; ``attitude_from`` names the record of the attitude, ``of_view``
    says whether it is not always the body's, ``primary_airspeed`` is the number of the airspeed
    sensor to take where records do not say which is used, and ``lanes`` has the times (n,) and
    numbers (n,) of EKF3's primary lane; ``first_time`` (s) is given to records without a time that
    stand before all others.
    """

    speed_accuracy: Mapping[int, Series]
    message_time: Mapping[int, Series]
    written_late: Mapping[int, float]
    vertical_speed: Mapping[int, bool]
    ekf_status_from: str
    motor_channels: tuple[str, ...]
    motor_range_us: tuple[float, float]
    attitude_from: str
    of_view: bool
    primary_airspeed: int
    lanes: Series
    first_time: float


def context_of(index: DataflashIndex, first_time: float) -> Context:
    """Look through the records that say it."""
    counts, parameters = index.counts(), _parameters(index)
    message_time = {n: _plausible(x) for n, x in _beside_fixes(index, "SMS", 1e3).items()}
    # As ATT is it where ATT is of the body, minus AHRS_TRIM too (NavEKF3_core::getEulerAngles).
    views, by_ekf3 = tells_views(parameters, over_mavlink=False), counts.get(EKF3_ATTITUDE, 0) > 0
    return Context(
        speed_accuracy=_beside_fixes(index, "SAcc", 1.0),
        message_time=message_time,
        written_late={n: float(np.mean(t - x)) for n, (t, x) in message_time.items() if len(t)},
        vertical_speed=_vertical_speed(index),
        ekf_status_from=_ekf_status(parameters, counts),
        motor_channels=() if counts.get("CTUN") else _motor_channels(parameters),
        motor_range_us=_motor_range(parameters),
        attitude_from=EKF3_ATTITUDE if views and by_ekf3 else ATTITUDE,
        of_view=views and not by_ekf3,
        primary_airspeed=primary_airspeed(parameters),
        lanes=_lanes(index),
        first_time=first_time,
    )


def receiver_of(form: Format, records: Records) -> list[int]:
    """(n,) number of the GPS receiver, from 1."""
    if form.has("I"):
        return [i + 1 for i in form.integers(records, "I")]
    return [2 if form.name.endswith("2") else 1] * len(records)


def _parameters(index: DataflashIndex) -> dict[str, float]:
    """Parameters by name, the last value of each."""
    values: dict[str, float] = {}
    for form, records in index.all_of("PARM"):
        if form.has("Name", "Value"):
            names = (bytes(name).decode("ascii", "replace") for name in records["Name"])
            values.update(zip(names, form.numbers(records, "Value").tolist(), strict=True))
    return values


def _beside_fixes(index: DataflashIndex, column: str, divisor: float) -> dict[int, Series]:
    """A field of the GPA records by receiver; none of layouts that lack it."""
    parts: dict[int, list[Series]] = {}
    for form, records in index.all_of("GPA"):
        if not form.has(column, "TimeUS"):
            continue
        receivers = np.array(receiver_of(form, records))
        t, x = form.numbers(records, "TimeUS") / 1e6, form.numbers(records, column) / divisor
        for receiver in np.unique(receivers).tolist():
            mine = receivers == receiver
            parts.setdefault(receiver, []).append((t[mine], x[mine]))
    series = {}
    for receiver, pieces in parts.items():
        t, x = (np.concatenate(values) for values in zip(*pieces, strict=True))
        order = np.argsort(t, kind="stable")
        series[receiver] = t[order], x[order]
    return series


def _plausible(series: Series) -> Series:
    """Without times that cannot be of a message that was written then."""
    t, message = series
    near = np.abs(t - message) < LONGEST_WAIT_S
    return t[near], message[near]


def _vertical_speed(index: DataflashIndex) -> dict[int, bool]:
    """A receiver without vertical speed logs zeros, and GPA.VV says so."""
    denied: set[int] = set()
    for form, records in index.all_of("GPA"):
        if form.has("VV"):
            receivers = np.array(receiver_of(form, records))
            have = set(receivers[form.numbers(records, "VV") != 0.0].tolist())
            denied |= set(receivers.tolist()) - have
    measured: dict[int, bool] = {}
    for name in GPS_NAMES:
        for form, records in index.all_of(name):
            if form.has("VZ"):
                receivers = np.array(receiver_of(form, records))
                for receiver in np.unique(receivers).tolist():
                    moves = bool(form.numbers(records, "VZ")[receivers == receiver].any())
                    measured[receiver] = measured.get(receiver, False) or moves
    return {receiver: moves and receiver not in denied for receiver, moves in measured.items()}


def _ekf_status(parameters: Mapping[str, float], counts: Mapping[str, int]) -> str:
    """XKF4 or NKF4: the record of the EKF that AHRS_EKF_TYPE chooses, or that there is."""
    chosen = parameters.get("AHRS_EKF_TYPE")
    if chosen is None:
        return "XKF4" if counts.get("XKF4") else "NKF4"
    return "NKF4" if chosen == EKF2 else "XKF4"


def _lanes(index: DataflashIndex) -> Series:
    """The primary lane, as the records of all lanes say it."""
    parts = [
        (form.numbers(records, "TimeUS") / 1e6, form.numbers(records, "PI"))
        for form, records in index.all_of("XKF4")
        if form.has("TimeUS", "PI")
    ]
    if not parts:
        return np.zeros(0), np.zeros(0)
    t, lane = (np.concatenate(values) for values in zip(*parts, strict=True))
    order = np.argsort(t, kind="stable")
    return t[order], lane[order]


def _motor_channels(parameters: Mapping[str, float]) -> tuple[str, ...]:
    driving = {*rotor_functions(parameters.get("FRAME_CLASS")), THROTTLE_FUNCTION}
    numbers = range(1, CHANNELS + 1)
    return tuple(f"C{n}" for n in numbers if parameters.get(f"SERVO{n}_FUNCTION") in driving)


def _motor_range(parameters: Mapping[str, float]) -> tuple[float, float]:
    low, high = parameters.get("MOT_PWM_MIN", 0.0), parameters.get("MOT_PWM_MAX", 0.0)
    return (low, high) if 0.0 < low < high else (1000.0, 2000.0)
