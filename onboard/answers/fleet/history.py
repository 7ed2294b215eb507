"""What the flights of one vehicle say together: each number over time, and the six merged."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.answers.document_numbers import TIMING
from onboard.answers.fleet.record import ImuRecord
from onboard.answers.fleet.vehicles import Flight, Vehicle
from onboard.answers.recorded import KEEPING_ALL
from onboard.core.diagnosis.joined import Heard
from onboard.core.estimate.joint import FLOOR
from onboard.core.estimate.limits import TIMING_FLOOR_S
from onboard.core.estimate.merged_flights import Prior
from onboard.core.estimate.result import SIX_NAMES, Estimate
from onboard.core.fleet.course import Course, Series, follow, places
from onboard.core.fleet.sensor import Together, alone, together
from onboard.core.maths.accelerometer import SixParameters

DAY_S = 86_400.0
"""s of a day [definition]."""
UNITS = ("1", "1", "1", "m/s^2", "m/s^2", "m/s^2")
DELAYS = tuple(name for name in TIMING if name.endswith("_delay_s"))
"""Followed over time; the averaging window has no sigma of its own at zero."""
COMMON = dict.fromkeys(DELAYS, TIMING_FLOOR_S)
"""Sigma of what is wrong with all flights alike: averaging does not make it less."""
ANTENNA = ("antenna_x_m", "antenna_y_m", "antenna_z_m")
UNTOLD = "it does not say which parameters were in force, other flights do"
DRIFTING = "{} drifts: flights that differ for a reason have no mean"
NOBODY = "flights contradict each other, and nobody can say which are right"


@dataclass(frozen=True, slots=True)
class Number:
    """One number of a vehicle over its flights.

    Attributes:
        name: ``x scale`` ... ``z offset`` of an accelerometer; ``gps_delay_s``, ``antenna_x_m``.
        unit: of the value.
        flights: that know it, in order.
        series: their values.
        course: what is said of them.
        common: sigma of what is wrong with all flights alike: no drift and no step, and no less in
            any mean of them (the floors, the gyroscope's axes, effects that no flight shows by
            itself).
    """

    name: str
    unit: str
    flights: tuple[Flight, ...]
    series: Series
    course: Course
    common: float

    @property
    def latest(self) -> tuple[float, float]:
        """The number at the last flight that is not odd, and its sigma with what is common."""
        value, sigma = self.course.latest
        return value, math.hypot(sigma, self.common)


@dataclass(frozen=True, slots=True)
class Accelerometer:
    """One accelerometer of a vehicle.

    Attributes:
        imu: its number.
        device: its device id; 0 where no flight says it.
        flights: that say something of it, in order.
        numbers: the six, those that any flight knows.
        merged: of the flights since the last step; None where there is nothing to merge.
        why: there is nothing, in words.
        left_out: flights that say nothing, with the reason.
    """

    imu: int
    device: int
    flights: tuple[Flight, ...]
    numbers: tuple[Number, ...]
    merged: Together | None
    why: str
    left_out: tuple[tuple[Flight, str], ...]


@dataclass(frozen=True, slots=True)
class History:
    """A vehicle over time; ``looked_at`` candidates were tried with one false alarm for all."""

    vehicle: Vehicle
    accelerometers: tuple[Accelerometer, ...]
    numbers: tuple[Number, ...]
    looked_at: int


@dataclass(frozen=True, slots=True)
class _Heard:
    """A flight and its record of one accelerometer."""

    flight: Flight
    imu: ImuRecord


@dataclass(frozen=True, slots=True)
class _Asked:
    name: str
    unit: str
    flights: tuple[Flight, ...]
    series: Series
    common: float


def history_of(vehicle: Vehicle) -> History:
    """Everything about one vehicle's numbers over time."""
    sensors = _sensors(vehicle)
    asked = {key: _six(heard) for key, (heard, _) in sensors.items()}
    beside = [*_delays(vehicle), *_antenna(vehicle)]
    looked_at = sum(places(a.series) for group in (*asked.values(), beside) for a in group)
    return History(
        vehicle,
        tuple(
            _accelerometer(key, heard, left_out, _followed(asked[key], looked_at))
            for key, (heard, left_out) in sensors.items()
        ),
        _followed(beside, looked_at),
        looked_at,
    )


def _followed(asked: Sequence[_Asked], looked_at: int) -> tuple[Number, ...]:
    return tuple(
        Number(a.name, a.unit, a.flights, a.series, follow(a.series, looked_at), a.common)
        for a in asked
    )


def _sensors(
    vehicle: Vehicle,
) -> dict[tuple[int, int], tuple[list[_Heard], list[tuple[Flight, str]]]]:
    """By number and device id: the flights that count, and the others with the reason."""
    every: dict[tuple[int, int], list[_Heard]] = {}
    for flight in vehicle.counting:
        ids = flight.record.provenance.accelerometers
        for imu in flight.record.imus:
            n = imu.calibration.imu
            every.setdefault((n, ids.get(n, 0)), []).append(_Heard(flight, imu))
    out = {}
    for key, heard in sorted(every.items()):
        told = any(h.imu.calibration.parameters_known for h in heard)
        left_out = [(h.flight, why) for h in heard if (why := h.imu.why or _untold(h, told=told))]
        gone = {id(flight) for flight, _ in left_out}
        out[key] = [h for h in heard if id(h.flight) not in gone], left_out
    return out


def _untold(h: _Heard, *, told: bool) -> str:
    if told and not h.imu.calibration.parameters_known:
        return UNTOLD
    return "" if h.imu.said is not None else "it has no numbers"


def _prior(imu: ImuRecord) -> Prior:
    c = imu.calibration
    in_force = SixParameters(c.in_force_scale, c.in_force_offset)
    return Prior(in_force.as_linear(), KEEPING_ALL.needs.prior)


def _six(heard: Sequence[_Heard]) -> list[_Asked]:
    """The six numbers that any flight knows by itself."""
    said = [alone(h.imu.said.six, _prior(h.imu)) for h in heard if h.imu.said is not None]
    if not said:
        return []
    values, sigmas = np.array([s.value for s in said]), np.array([s.sigma for s in said])
    warm = [h.imu.calibration.temperature for h in heard]
    common = np.hypot(FLOOR, heard[-1].imu.calibration.gyro_sigma)
    flights = [h.flight for h in heard]
    return [
        asked
        for i, (name, unit) in enumerate(zip(SIX_NAMES, UNITS, strict=True))
        if (
            asked := _asked(name, unit, flights, values[:, i], sigmas[:, i], warm, float(common[i]))
        )
    ]


def _asked(
    name: str,
    unit: str,
    flights: Sequence[Flight],
    values: Sequence[float] | np.ndarray[tuple[int], np.dtype[np.float64]],
    sigmas: Sequence[float] | np.ndarray[tuple[int], np.dtype[np.float64]],
    temperatures: Sequence[Estimate | None],
    common: float,
) -> _Asked | None:
    """A series of the flights that know the number; None if none does."""
    known = [
        k for k in range(len(flights)) if math.isfinite(values[k]) and 0.0 < sigmas[k] < math.inf
    ]
    if not known:
        return None
    warm = [t.value for k in known if (t := temperatures[k]) is not None]
    return _Asked(
        name,
        unit,
        tuple(flights[k] for k in known),
        Series(
            np.array([values[k] for k in known]),
            np.array([sigmas[k] for k in known]),
            np.array([flights[k].began_unix_s / DAY_S for k in known]),
            np.array(warm) if len(warm) == len(known) else None,
        ),
        common,
    )


def first_heard(vehicle: Vehicle) -> list[tuple[Flight, ImuRecord]]:
    """Flights by the accelerometer that most of them count with: of each, timing is its own."""
    every = [(f, i) for f in vehicle.counting for i in f.record.imus if i.said is not None]
    count = Counter(i.calibration.imu for _, i in every)
    best = max(count, key=lambda n: (count[n], -n), default=0)
    return [(f, i) for f, i in every if i.calibration.imu == best]


def _delays(vehicle: Vehicle) -> list[_Asked]:
    heard = first_heard(vehicle)
    out = []
    for name in DELAYS:
        known = [(f, e) for f, i in heard if (e := i.calibration.timing.get(name)) is not None]
        none = [None] * len(known)
        values, sigmas = [e.value for _, e in known], [e.sigma for _, e in known]
        flights = [f for f, _ in known]
        out.append(_asked(name, "s", flights, values, sigmas, none, COMMON[name]))
    return [a for a in out if a is not None]


def _antenna(vehicle: Vehicle) -> list[_Asked]:
    """Where the antenna is: as told, and what was found beside it."""
    heard = [(f, i) for f, i in first_heard(vehicle) if f.record.provenance.antenna_m]
    out = []
    for k, name in enumerate(ANTENNA):
        values, sigmas = [], []
        for flight, imu in heard:
            told, found = flight.record.provenance.antenna_m, imu.antenna
            value = None if found is None else found.value[k]
            sigma = None if found is None else found.sigma[k]
            known = value is not None and sigma is not None and told is not None
            values.append(told[k] + value if known and told and value is not None else math.nan)
            sigmas.append(sigma if known and sigma is not None else math.nan)
        none = [None] * len(heard)
        out.append(_asked(name, "m", [f for f, _ in heard], values, sigmas, none, 0.0))
    return [a for a in out if a is not None]


def _accelerometer(
    key: tuple[int, int],
    heard: Sequence[_Heard],
    left_out: Sequence[tuple[Flight, str]],
    numbers: tuple[Number, ...],
) -> Accelerometer:
    imu, device = key
    merged, why = _merged(heard, numbers)
    if merged is not None:
        # What all flights leave open is wrong with all of them alike.
        open_ = dict(zip(SIX_NAMES, merged.open_sigma, strict=True))
        numbers = tuple(
            replace(n, common=math.hypot(n.common, float(open_[n.name]))) for n in numbers
        )
    return Accelerometer(
        imu, device, tuple(h.flight for h in heard), numbers, merged, why, tuple(left_out)
    )


def _merged(heard: Sequence[_Heard], numbers: Sequence[Number]) -> tuple[Together | None, str]:
    """The six of the flights since the last step of any, without odd ones."""
    if not heard:
        return None, "no flight says anything"
    drifting = [n.name for n in numbers if n.course.drifts]
    if drifting:
        return None, DRIFTING.format(" and ".join(drifting))
    since = max(
        (n.flights[s.last + 1].began_unix_s for n in numbers for s in n.course.steps), default=-1.0
    )
    odd = {id(n.flights[o.flight]) for n in numbers for o in n.course.odd}
    which = [
        k for k, h in enumerate(heard) if h.flight.began_unix_s >= since and id(h.flight) not in odd
    ]
    if not which:
        return None, NOBODY
    said = [
        Heard(h.imu.said.six, [a.asked for a in h.imu.asked])
        for k in which
        if (h := heard[k]).imu.said is not None
    ]
    last = heard[which[-1]].imu
    found = together(said, _prior(last), np.array(last.calibration.gyro_sigma))
    if found is None:
        return None, NOBODY
    counted, others = (
        tuple(which[k] for k in some) for some in (found.counted, found.contradicted)
    )
    return replace(found, counted=counted, contradicted=others), ""
