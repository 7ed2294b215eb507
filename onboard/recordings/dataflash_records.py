"""DataFlash records to samples: one converter per type of record, old layouts and new.

Angles are degrees in the log and radians in samples; the clock is the autopilot's
boot clock (``TimeUS``; ``TimeMS`` before ArduPilot 3.3; in those logs the GPS record has
GPS week milliseconds in ``TimeMS`` and the boot clock in ``T``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from onboard.core.inputs.samples import (
    AirData,
    Battery,
    EkfBias,
    EkfHealth,
    GpsFix,
    Outputs,
    ParameterValue,
    Throttle,
    VehicleState,
    Vibration,
)
from onboard.recordings.bulk import samples_of
from onboard.recordings.dataflash_batch import Batch, Converted, Converter
from onboard.recordings.dataflash_context import (
    ATTITUDE,
    CHANNELS,
    EKF3_ATTITUDE,
    GPS_NAMES,
    Context,
    Floats,
    Series,
    receiver_of,
)
from onboard.recordings.dataflash_inertial import attitude, imu

SECONDS_PER_WEEK = 604800.0
SAME_FIX_S = 2e-3
"""GPA is written right after the GPS record that it belongs to."""
LONGEST_SILENCE_S = 2.0
"""s; an accuracy that was told longer ago is of no use: the slowest receivers measure once a
second, and one of their records may be missing [data sheet]."""
HDOP_UNKNOWN = 99.0
CLIPS = ("Clip", "Clip0", "Clip1", "Clip2")
STATUS_BITS = 0x3FF
"""The low ten bits of the EKF's nav_filter_status are those of EKF_STATUS_REPORT."""
STATUS_GPS_GLITCHING, REPORT_GPS_GLITCHING = 1 << 14, 1 << 15
EVENTS: dict[int, tuple[bool | None, bool | None]] = {
    10: (True, None),
    11: (False, None),
    17: (None, True),
    18: (None, True),
    28: (None, False),
}
"""EV record: event number to (armed, landed)."""


def gps(batch: Batch, context: Context) -> Converted:
    """GPS, GPS2; speed accuracy and the EKF's time are in GPA, the receiver's in GMS and GWk.

    A record is stamped when it is written, and how long a fix waits for that changes in flight, by
    tens of milliseconds: the stamp is that of the EKF's time and the log's mean wait.
    """
    form, records = batch.form, batch.records
    speed = form.numbers(records, "Spd")
    course = np.radians(form.numbers(records, "GCrs"))
    v_n, v_e = (speed * np.cos(course)).tolist(), (speed * np.sin(course)).tolist()
    lat, lng, alt = batch.floats("Lat", "Lng", "Alt")
    milliseconds, weeks = ("GMS", "GWk") if form.has("GMS") else ("TimeMS", "Week")
    week, ms = batch.integers(weeks), batch.integers(milliseconds)
    hdop = batch.floats("HDop")[0] if form.has("HDop") else [math.inf] * len(lat)
    receivers, written = receiver_of(form, records), batch.t.tolist()
    messages = _of_fixes(context.message_time, receivers, batch.t, SAME_FIX_S)
    accuracies = _of_fixes(context.speed_accuracy, receivers, batch.t, LONGEST_SILENCE_S)
    if form.has("VZ"):
        down = [
            v if context.vertical_speed.get(receiver, False) else None
            for v, receiver in zip(batch.floats("VZ")[0], receivers, strict=True)
        ]
    else:
        down = [None] * len(lat)
    return samples_of(
        GpsFix,
        [
            t if message is None else message + context.written_late[receiver]
            for t, message, receiver in zip(written, messages, receivers, strict=True)
        ],
        receivers,
        batch.integers("Status"),
        [math.radians(x) for x in lat],
        [math.radians(x) for x in lng],
        alt,
        v_n,
        v_e,
        down,
        [w * SECONDS_PER_WEEK + m / 1e3 if w else None for w, m in zip(week, ms, strict=True)],
        [n if n >= 0 else None for n in batch.integers("NSats", -1)],
        [x if x < HDOP_UNKNOWN else None for x in hdop],
        [x if x is not None and x > 0.0 else None for x in accuracies],
        [0.0] * len(lat),
        messages,
    )


def _of_fixes(
    series: Mapping[int, Series], receivers: list[int], t: Floats, oldest: float
) -> list[float | None]:
    """Values of the records written with, or last before, fixes at ``t`` (n,).

    None where there is none, or only one that is older than ``oldest``, s.
    """
    values: list[float | None] = [None] * len(t)
    numbers = np.array(receivers)
    for receiver, (times, of_receiver) in series.items():
        rows = np.flatnonzero(numbers == receiver)
        last = np.searchsorted(times, t[rows] + SAME_FIX_S, side="right") - 1
        known = (last >= 0) & ~(t[rows] - times[last] > oldest) if len(times) else last > 0
        its = of_receiver[last[known]].tolist()
        for row, value in zip(rows[known].tolist(), its, strict=True):
            values[row] = value
    return values


def vibration(batch: Batch, _context: Context) -> Converted:
    """VIBE: one record per IMU, before ArduPilot 4.1 one with three clip counters."""
    t = batch.t.tolist()
    level = list(zip(*batch.floats("VibeX", "VibeY", "VibeZ"), strict=True))
    counters = [batch.integers(c) for c in CLIPS if batch.form.has(c)]
    clips = list(zip(*counters, strict=True)) if counters else [()] * len(t)
    if not batch.form.has("IMU"):
        return samples_of(Vibration, t, level, clips)
    numbers = [number + 1 for number in batch.integers("IMU")]
    return samples_of(Vibration, t, level, clips, numbers)


def throttle(batch: Batch, _context: Context) -> Converted:
    """CTUN: ThO is 0 ... 1 on a copter and percent on a plane; old copters had 0 ... 1000."""
    column = next((c for c in ("ThO", "ThrOut") if batch.form.has(c)), None)
    if column is None:
        return [None] * len(batch.t)
    full = 100.0 if batch.form.has("NavRoll") else 1.0 if column == "ThO" else 1000.0
    values = batch.form.numbers(batch.records, column) / full
    return samples_of(Throttle, batch.t.tolist(), values.tolist())


def motors(batch: Batch, context: Context) -> Converted:
    """RCOU: mean output of the motors, where the log has no CTUN."""
    channels = [c for c in context.motor_channels if batch.form.has(c)]
    if not channels:
        return [None] * len(batch.t)
    low, high = context.motor_range_us
    mean = np.mean([batch.form.numbers(batch.records, c) for c in channels], axis=0)
    share = np.clip((mean - low) / (high - low), 0.0, 1.0)
    return samples_of(Throttle, batch.t.tolist(), share.tolist())


def outputs(batch: Batch, _context: Context) -> Converted:
    """RCOU: pulse widths of the channels that the layout has."""
    columns = [c for c in (f"C{n}" for n in range(1, CHANNELS + 1)) if batch.form.has(c)]
    if not columns:
        return [None] * len(batch.t)
    values = list(zip(*batch.floats(*columns), strict=True))
    return samples_of(Outputs, batch.t.tolist(), values)


def airspeed(batch: Batch, context: Context) -> Converted:
    """ARSP, and ASP2 of old logs: the sensor that is the primary one, as VFR_HUD has it."""
    values, form = batch.floats("Airspeed")[0], batch.form
    second = int(form.name == SECOND_AIRSPEED)
    sensor = batch.integers("I", second)
    told = "Primary" if form.has("Primary") else "Pri"
    primary = batch.integers(told, context.primary_airspeed)
    return [
        AirData(t, airspeed=v) if i == its else None
        for t, v, i, its in zip(batch.t.tolist(), values, sensor, primary, strict=True)
    ]


def ekf_bias(batch: Batch, _context: Context) -> Converted:
    """XKF2: accelerometer bias of each EKF3 core, steps of 0.01 m/s^2."""
    if not batch.form.has("AX", "AY", "AZ"):
        return [None] * len(batch.t)
    bias = list(zip(*batch.floats("AX", "AY", "AZ"), strict=True))
    return samples_of(EkfBias, batch.t.tolist(), batch.integers("C"), bias)


def wind(batch: Batch, _context: Context) -> Converted:
    """XKF2: wind estimate of the first core."""
    north, east = batch.floats("VWN", "VWE")
    core = batch.integers("C")
    return [
        AirData(t, wind_n=north[k], wind_e=east[k]) if core[k] == 0 else None
        for k, t in enumerate(batch.t.tolist())
    ]


def ekf_status(batch: Batch, context: Context) -> Converted:
    """XKF4 (EKF3) or NKF4 (EKF2), the primary core: solution status as EKF_STATUS_REPORT flags."""
    if batch.form.name != context.ekf_status_from:
        return [None] * len(batch.t)
    core, primary, status = batch.integers("C"), batch.integers("PI"), batch.integers("SS")
    lanes = batch.form.has("C")
    return [
        None
        if lanes and core[k] != primary[k]
        else EkfHealth(
            t,
            (status[k] & STATUS_BITS)
            | (REPORT_GPS_GLITCHING if status[k] & STATUS_GPS_GLITCHING else 0),
        )
        for k, t in enumerate(batch.t.tolist())
    ]


def battery(batch: Batch, _context: Context) -> Converted:
    """BAT of the first battery, or CURR; integer fields of old logs are hundredths."""
    if not batch.form.has("Volt", "Curr"):
        return [None] * len(batch.t)
    scale = 0.01 if batch.form.letter("Volt") in "hH" else 1.0
    volts, amperes = batch.floats("Volt", "Curr")
    number = batch.integers("Inst") if batch.form.has("Inst") else batch.integers("I")
    return [
        Battery(t, volts[k] * scale, amperes[k] * scale) if number[k] == 0 else None
        for k, t in enumerate(batch.t.tolist())
    ]


def parameter(batch: Batch, _context: Context) -> Converted:
    """PARM."""
    values = batch.floats("Value")[0]
    timed = batch.form.has("TimeUS") or batch.form.has("TimeMS")
    return [
        ParameterValue(
            bytes(name).decode("ascii", errors="replace"),
            value,
            t if timed and np.isfinite(t) else None,
        )
        for name, value, t in zip(batch.records["Name"], values, batch.t.tolist(), strict=True)
    ]


def event(batch: Batch, _context: Context) -> Converted:
    """EV: arming and landing events of copters."""
    return [
        VehicleState(t, *EVENTS[number]) if number in EVENTS else None
        for t, number in zip(batch.t.tolist(), batch.integers("Id"), strict=True)
    ]


def arming(batch: Batch, _context: Context) -> Converted:
    """ARM."""
    states = batch.integers("ArmState")
    return [VehicleState(t, armed=bool(s)) for t, s in zip(batch.t.tolist(), states, strict=True)]


def flying(batch: Batch, _context: Context) -> Converted:
    """STAT of planes: whether it flies, and in old logs whether it is armed."""
    fly, has_armed = batch.integers("isFlying"), batch.form.has("Armed")
    armed = batch.integers("Armed")
    return [
        VehicleState(t, armed=bool(armed[k]) if has_armed else None, landed=not fly[k])
        for k, t in enumerate(batch.t.tolist())
    ]


def firmware(batch: Batch, _context: Context) -> Converted:
    """MSG: the firmware's name, with which every log begins, is that of the kind of vehicle."""
    texts = (bytes(text).decode("ascii", errors="replace") for text in batch.records["Message"])
    kinds = (next((k for n, k in FIRMWARE.items() if text.startswith(n)), "") for text in texts)
    return [
        VehicleState(t, kind=kind) if kind else None
        for t, kind in zip(batch.t.tolist(), kinds, strict=True)
    ]


FIRMWARE = {
    "ArduCopter": "copter",
    "ArduPlane": "plane",
    "ArduRover": "rover",
    "ArduSub": "submarine",
    "Blimp": "airship",
}
IMU_NAMES = ("IMU", "IMU2", "IMU3")
ATTITUDE_NAMES = (ATTITUDE, EKF3_ATTITUDE)
SECOND_AIRSPEED = "ASP2"
AIRSPEED_NAMES = ("ARSP", SECOND_AIRSPEED)
CONVERTERS: dict[str, tuple[Converter, ...]] = {
    **dict.fromkeys(IMU_NAMES, (imu,)),
    **dict.fromkeys(GPS_NAMES, (gps,)),
    **dict.fromkeys(ATTITUDE_NAMES, (attitude,)),
    "VIBE": (vibration,),
    "CTUN": (throttle,),
    "RCOU": (motors, outputs),
    **dict.fromkeys(AIRSPEED_NAMES, (airspeed,)),
    "XKF2": (ekf_bias, wind),
    "XKF4": (ekf_status,),
    "NKF4": (ekf_status,),
    "BAT": (battery,),
    "CURR": (battery,),
    "PARM": (parameter,),
    "EV": (event,),
    "ARM": (arming,),
    "STAT": (flying,),
    "MSG": (firmware,),
}
NEEDED: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(IMU_NAMES, ("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ")),
    **dict.fromkeys(GPS_NAMES, ("Status", "Lat", "Lng", "Alt", "Spd", "GCrs")),
    **dict.fromkeys(ATTITUDE_NAMES, ("Roll", "Pitch", "Yaw")),
    "VIBE": ("VibeX", "VibeY", "VibeZ"),
    **dict.fromkeys(AIRSPEED_NAMES, ("Airspeed",)),
    "XKF2": ("VWN", "VWE"),
    "XKF4": ("SS",),
    "NKF4": ("SS",),
    "PARM": ("Name", "Value"),
    "EV": ("Id",),
    "ARM": ("ArmState",),
    "STAT": ("isFlying",),
    "MSG": ("Message",),
}
"""Fields without which a record of that name is another thing, and is not read."""
