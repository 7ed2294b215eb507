"""Flights straight to a recording, as fast as they can be generated: no sockets, no waiting.

``fly(spec)`` gives frames as a .tlog holds them, ``fly_messages(spec)`` the messages
themselves, ``write_tlog(spec, path)`` the file.  All of them run the very autopilot that
the server runs, so that a recording is what a client of that server would have recorded.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin import gps
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.differences import differences
from sitl.builtin.autopilot import Autopilot
from sitl.builtin.effects import Effect
from sitl.builtin.messages import Message, packed
from sitl.builtin.trajectory import Environment
from sitl.builtin.truth import CompassTruth, GpsTruth, ImuTruth, Truth
from sitl.builtin.world import Piece, Vehicle

START_UNIX_US = 1_760_000_000_000_000
LEAD = 6.0
"""Seconds between power-on and launch."""

DEFAULT_RATES: Mapping[str, float] = {
    "RAW_IMU": 50.0,
    "ATTITUDE": 50.0,
    "GPS_RAW_INT": 10.0,
    "VFR_HUD": 5.0,
    "VIBRATION": 2.0,
    "EXTENDED_SYS_STATE": 2.0,
    "EKF_STATUS_REPORT": 2.0,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 1.0,
    "GLOBAL_POSITION_INT": 5.0,
    "SYSTEM_TIME": 1.0,
}

AIRFRAME_RATES: Mapping[str, float] = {
    "VFR_HUD": 10.0,
    "BATTERY_STATUS": 5.0,
    "LOCAL_POSITION_NED": 10.0,
    "SERVO_OUTPUT_RAW": 50.0,
}
"""Rates (Hz) of what tells of an airframe, in flights that have one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightSpec:
    """One flight, completely described: the same spec always gives the same recording.

    ``duration`` counts from power-on to the end of the recording (s).  ``parameters`` are the
    autopilot's that differ from its defaults.  ``rates`` (Hz) replace the default message
    rates one by one; 0 leaves a message out.  SCALED_IMU2/3 come at RAW_IMU's rate where
    there are such IMUs.  ``aircraft`` gives the vehicle an airframe with physics of its own,
    and its outputs to the recording.
    """

    vehicle: Vehicle = "copter"
    seed: int = 0
    duration: float = 300.0
    imus: tuple[ImuTruth, ...] = (ImuTruth(),)
    gps: GpsTruth = field(default_factory=GpsTruth)
    compass: CompassTruth = field(default_factory=CompassTruth)
    environment: Environment = field(default_factory=Environment)
    effects: tuple[Effect, ...] = ()
    attitude_errors: bool = True
    orientation: int = 0
    parameters: Mapping[str, float] = field(default_factory=dict)
    rates: Mapping[str, float] = field(default_factory=dict)
    loop_rate: int = 400
    dull: bool = False
    start_unix_us: int = START_UNIX_US
    aircraft: Aircraft | None = None

    @property
    def truth(self) -> Truth:
        """The hardware."""
        return Truth(
            imus=self.imus,
            gps=self.gps,
            compass=self.compass,
            environment=self.environment,
            effects=self.effects,
            attitude_errors=self.attitude_errors,
            orientation=self.orientation,
            seed=self.seed,
            aircraft=self.aircraft,
        )


@dataclass(slots=True)
class Flight:
    """A flight that has been flown: messages with their times, and the physics behind them."""

    spec: FlightSpec
    messages: list[tuple[int, Message]]
    pieces: list[Piece]
    autopilot: Autopilot


def run(spec: FlightSpec) -> Flight:
    """Flies it."""
    autopilot = Autopilot(
        spec.vehicle,
        spec.truth,
        parameters=spec.parameters,
        loop_rate=spec.loop_rate,
        dull=spec.dull,
    )
    link = autopilot.connect()
    for name in list(_names(spec)):
        autopilot.links.set_rate(link, name, _rate(spec, name))
    autopilot.links.request_parameters(link)
    autopilot.advance(LEAD)
    autopilot.arm(force=True)
    autopilot.take_off(spec.duration - LEAD)
    autopilot.advance(1.0 / spec.loop_rate)
    # The world is complete from here on: keep its pieces before time passes them.
    pieces = list(autopilot.world.pieces)
    autopilot.advance(spec.duration - autopilot.clock)
    stamped = [(spec.start_unix_us + round(t * 1e6), message) for t, message in link.outbox]
    return Flight(spec, stamped, pieces, autopilot)


def fly(spec: FlightSpec) -> list[tuple[int, bytes]]:
    """Flies it; (unix time in us, MAVLink 2 frame) in the order of sending."""
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    return [(unix_us, packed(message, packer)) for unix_us, message in run(spec).messages]


def fly_messages(spec: FlightSpec) -> Iterator[tuple[int, Message]]:
    """Flies it; (unix time in us, pymavlink message), neither packed nor parsed."""
    yield from sent(run(spec))


def sent(flight: Flight) -> Iterator[tuple[int, Message]]:
    """Messages of a flight; their headers tell sender and sequence, as if they had been packed."""
    for sequence, (unix_us, message) in enumerate(flight.messages):
        header = message.get_header()
        header.seq, header.srcSystem, header.srcComponent = sequence % 256, 1, 1
        yield unix_us, message


def write_tlog(spec: FlightSpec, path: str | Path) -> dict[str, Any]:
    """Flies it into a .tlog; returns the truth record."""
    with Path(path).open("wb") as file:
        for unix_us, frame in fly(spec):
            file.write(struct.pack(">Q", unix_us))
            file.write(frame)
    return truth_record(spec)


def truth_record(spec: FlightSpec) -> dict[str, Any]:
    """What an estimate is scored against, as a JSON object.

    Scale and offset are ArduPilot's, per IMU; ``net_gps_delay_s`` is how late GPS_RAW_INT's
    stamp is against accelerometer times corrected for the declared low-pass.
    """
    truth = spec.truth
    latency = gps.total_latency(truth)
    return {
        "vehicle": spec.vehicle,
        "seed": truth.seed,
        "imus": [{"scale": list(imu.scale), "offset": list(imu.offset)} for imu in truth.imus],
        "net_gps_delay_s": latency - truth.gps.stamped_early,
        "gps_smoothing_window_s": gps.smoothing_window(truth),
        "effects": [effect.as_record() for effect in truth.effects],
        **({} if truth.aircraft is None else {"vehicle_level": differences(truth.aircraft)}),
    }


def _names(spec: FlightSpec) -> Iterator[str]:
    defaults = _defaults(spec)
    yield from defaults
    yield from (name for name in spec.rates if name not in defaults)
    for imu in range(2, len(spec.truth.imus) + 1):
        if f"SCALED_IMU{imu}" not in spec.rates:
            yield f"SCALED_IMU{imu}"


def _rate(spec: FlightSpec, name: str) -> float:
    if name in spec.rates:
        return spec.rates[name]
    defaults = _defaults(spec)
    if name in defaults:
        return defaults[name]
    return spec.rates.get("RAW_IMU", DEFAULT_RATES["RAW_IMU"])


def _defaults(spec: FlightSpec) -> Mapping[str, float]:
    return DEFAULT_RATES if spec.aircraft is None else {**DEFAULT_RATES, **AIRFRAME_RATES}
