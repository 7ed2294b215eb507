"""From which moment ArduPilot counts GPS1_DELAY_MS, and where a recording's stamp lies to it.

Read in ArduPilot's source (4.7-dev, October 2025):

- The EKF takes ``last_message_time_ms - lag`` for the moment of a fix (``readGpsData``,
  AP_NavEKF3_Measurements.cpp; half a step of the filter, which it takes off too, makes up for
  fixes that wait for the next step).  ``lag`` (``AP_GPS::get_lag``) is the parameter, or what the
  driver assumes where that is 0.
- ``last_message_time_ms`` (``AP_GPS::update_instance``) is the arrival of the message less its time
  on the wire, with the jitter taken out by the receiver's own clock (``check_new_itow``,
  GPS_Backend.cpp).
- GPS_RAW_INT.time_usec is ``last_fix_time_ms``: the same number while there is a fix.
- DataFlash's GPS.TimeUS is when the record was written (``Write_GPS``), some 20 to 50 ms later.
  GPA.SMS, written with it, is ``last_message_time_ms``.  Firmware whose GPA has no SMS is older
  than the correction: it writes what it has just read.

So the latency against GPS_RAW_INT is the parameter, and that against GPS.TimeUS is the parameter
and what :class:`~onboard.core.inputs.segments.Fixes` calls ``late``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from onboard.core.inputs.parameters import ParametersInForce, receiver_names
from onboard.core.inputs.segments import Batch

U_BLOX: Final = (0.12, 0.22)
"""Generation 7 and later, and older ones; which it is, telemetry does not say."""
OTHERS: Final = (0.2,)
DRIVERS: Final[Mapping[int, tuple[float, ...]]] = MappingProxyType(
    {
        1: U_BLOX,  # found by itself: nearly always a u-blox; NMEA's 0.2 lies between
        2: U_BLOX,
        10: (0.08,),  # Septentrio
        17: (0.16, 0.22),  # moving baseline
        18: (0.16, 0.22),
        19: (0.11,),  # MSP
        21: (0.11,),  # an external AHRS
        24: (0.14,),  # Unicore
        25: (0.14,),
        26: (0.08,),
    }
)
"""What drivers assume by GPS1_TYPE, s (``get_lag`` of each AP_GPS backend)."""
RANGE_MS: Final = (1, 250)
"""Of the parameter: 0 stands for the driver's own, and no EKF keeps more than 250 ms."""


@dataclass(frozen=True, slots=True)
class FixClock:
    """What a latency against the recording's stamps means to the autopilot.

    Attributes:
        late: how much later the stamps are than the time from which the EKF counts back, s.
        configured: the parameter in force, s; 0 if it is 0 or not known.
        name: of the parameter.
        assumed: lags of which the autopilot takes one, s; empty if its receiver is not known.
    """

    late: float = 0.0
    configured: float = 0.0
    name: str = "GPS1_DELAY_MS"
    assumed: tuple[float, ...] = ()

    @property
    def configured_on_stamp(self) -> float:
        """The configured latency, as one against the recording's stamps, s."""
        return self.configured + self.late

    def setting(self, delay: float) -> float:
        """The parameter's value, ms, for a latency ``delay`` (s) against the stamps."""
        return float(np.clip(round(1e3 * (delay - self.late)), *RANGE_MS))

    def off(self, delay: float) -> float:
        """How far (s) the autopilot may be off with what it takes now; inf if that is not known."""
        away = [abs(delay - self.late - lag) for lag in self.assumed]
        return max(away, default=float("inf"))


def fix_clock(parameters: ParametersInForce, batches: Sequence[Batch]) -> FixClock:
    """The clock of the receiver in a flight."""
    configured, values = parameters.gps_delay_configured, parameters.values
    late = [c.fixes.late[c.trusted] for c in batches if len(c.fixes.late)]
    every = np.concatenate(late) if late else np.zeros(0)
    names = receiver_names(parameters.receiver)
    kind = parameters.get(*names["TYPE"], default=-1.0)
    assumed = DRIVERS.get(int(kind), OTHERS) if kind > 0.0 else ()
    now, former = names["DELAY_MS"]
    return FixClock(
        float(every.mean()) if len(every) else 0.0,
        configured,
        former if former in values and now not in values else now,
        (configured,) if configured > 0.0 else assumed,
    )
