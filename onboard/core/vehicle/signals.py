"""What a recording says of the vehicle beside its motion: outputs, battery, airspeed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from onboard.core.maths.arrays import Array, Mask
from onboard.core.vehicle.limits import LONGEST_SPAN_S

COVERED = 0.8
"""Share of a flight that a stream must be there for, to be used [cost]."""
SLOWER = 4.0
"""Times the usual distance of two samples, past which a slow stream has an outage [probability: of
telemetry that loses a fifth of its messages three in a row are lost once in a hundred]."""
EMPTY = np.zeros(0)
MOTOR_FUNCTIONS = (*range(33, 41), *range(82, 86), *range(160, 180))
"""SERVOn_FUNCTION of motors 1 to 32."""
TRICOPTER, SINGLE, COAXIAL = 7.0, 8.0, 9.0
TURNERS: Mapping[float, frozenset[int]] = {
    TRICOPTER: frozenset({39}),
    SINGLE: frozenset(range(33, 37)),
    COAXIAL: frozenset(range(33, 37)),
}
"""By FRAME_CLASS: functions of motors that are servos there, which turn a rotor or its stream."""
HELICOPTERS = (6.0, 11.0, 13.0)
"""FRAME_CLASS of what has a swash plate, whose servos have the numbers of motors."""
THROTTLE_FUNCTION, AILERON_FUNCTION, ELEVATOR_FUNCTION, RUDDER_FUNCTION = 70, 4, 19, 21
ELEVON_FUNCTIONS, VTAIL_FUNCTIONS = (77, 78), (79, 80)
"""SERVOn_FUNCTION of the left and the right one of surfaces that are two in one."""
FLAP_FUNCTIONS = (3, 2)
"""SERVOn_FUNCTION of flaps that go by themselves, and of those that a pilot sets."""


def rotor_functions(frame_class: float | None) -> tuple[int, ...]:
    """SERVOn_FUNCTION of what drives a rotor, where FRAME_CLASS or Q_FRAME_CLASS is this."""
    servos = TURNERS.get(frame_class, frozenset()) if frame_class is not None else frozenset()
    return tuple(f for f in MOTOR_FUNCTIONS if f not in servos)


def primary_airspeed(parameters: Mapping[str, float]) -> int:
    """Number of the airspeed sensor that the autopilot is to fly by, from zero."""
    return 1 if parameters.get("ARSPD_PRIMARY") == 1.0 else 0


def airspeed_ratio(parameters: Mapping[str, float]) -> str:
    """Name of the parameter that has the ratio of that sensor."""
    return "ARSPD2_RATIO" if primary_airspeed(parameters) else "ARSPD_RATIO"


@dataclass(frozen=True, slots=True)
class Stream:
    """A signal at its own times: ``t`` (n,) s on the boot clock, ``x`` (n, k)."""

    t: Array = field(default_factory=lambda: EMPTY)
    x: Array = field(default_factory=lambda: np.zeros((0, 1)))

    def __len__(self) -> int:
        return len(self.t)

    def at(self, t: Array) -> Array:
        """(m, k) values at times (m,) by straight lines, the ends held."""
        out = np.empty((len(t), self.x.shape[1]))
        for j in range(self.x.shape[1]):
            out[:, j] = np.interp(t, self.t, self.x[:, j])
        return out

    def covers(self, t: Array) -> bool:
        """Whether there are samples for most of the times (m,)."""
        if len(self) < 2 or len(t) == 0:
            return False
        inside = (t >= self.t[0] - 1.0) & (t <= self.t[-1] + 1.0)
        return bool(np.mean(inside) > COVERED)

    def known(self, t: Array) -> Mask:
        """(m,) whether times are not in an outage: a straight line over one is no measurement."""
        if len(self) < 2:
            return np.zeros(len(t), dtype=bool)
        apart = np.diff(self.t)
        longest = max(LONGEST_SPAN_S, SLOWER * float(np.median(apart)))
        before = np.clip(np.searchsorted(self.t, t, "right") - 1, 0, len(apart) - 1)
        begun, over = t >= self.t[0] - longest, t <= self.t[-1] + longest
        out: Mask = (apart[before] <= longest) & begun & over
        return out


@dataclass(frozen=True, slots=True)
class Signals:
    """Streams of one recording that only the vehicle level looks at.

    Attributes:
        outputs: pulse widths by channel, microseconds; or 0 to 1 where ``normalised``.
        battery: voltage (V) and current (A, NaN where it is not measured).
        airspeed: as the autopilot reports it, m/s.
        airspeed_dead: spans in which its sensor repeats one reading, which is not kept, s.
        ekf_wind: the autopilot's own estimate, towards north and east, m/s.
        measured_wind: by an anemometer or a tunnel: towards north and east, and its sigma, m/s.
        parameters: in force last, by name.
        kind: of vehicle: ``copter``, ``plane`` or another word; empty where nobody says.
        normalised: whether outputs are commands of the motors already.
    """

    outputs: Stream = field(default_factory=Stream)
    battery: Stream = field(default_factory=Stream)
    airspeed: Stream = field(default_factory=Stream)
    airspeed_dead: tuple[tuple[float, float], ...] = ()
    ekf_wind: Stream = field(default_factory=Stream)
    measured_wind: Stream = field(default_factory=Stream)
    parameters: Mapping[str, float] = field(default_factory=dict)
    kind: str = ""
    normalised: bool = False

    def channels_of(self, *functions: int) -> tuple[int, ...]:
        """Indices of the channels that have one of these SERVOn_FUNCTIONs, in that order."""
        width = self.outputs.x.shape[1] if len(self.outputs) else 0
        named = {
            int(self.parameters.get(f"SERVO{n + 1}_FUNCTION", -1.0)): n
            for n in reversed(range(width))
        }
        return tuple(named[f] for f in functions if f in named)

    @property
    def motors(self) -> tuple[int, ...]:
        """Channels of the motors; all that move where the recording has no parameters.

        None of a helicopter: its thrust is a matter of the blades' pitch.
        """
        if not len(self.outputs) or self.parameters.get("FRAME_CLASS") in HELICOPTERS:
            return ()
        if self.normalised:
            moving = np.std(np.nan_to_num(self.outputs.x), axis=0) > 0.0
            return tuple(np.flatnonzero(moving).tolist())
        if any(name.startswith("SERVO") for name in self.parameters):
            return self.channels_of(*rotor_functions(self.parameters.get("FRAME_CLASS")))
        return tuple(
            np.flatnonzero(np.std(np.nan_to_num(self.outputs.x), axis=0) > 5.0).tolist()[:8]
        )
