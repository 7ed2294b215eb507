"""What vehicles of one type share: the antenna beside where it is told, the receiver's latency."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from onboard.answers.fleet.history import ANTENNA, COMMON, DELAYS, first_heard
from onboard.answers.fleet.vehicles import RECORDING, Vehicle
from onboard.core.fleet.limits import FEWEST_VEHICLES, SHARED_FALSE_ALARM
from onboard.core.fleet.shared import Shared, pooled, shared

LATENCY, ATTITUDE = DELAYS


@dataclass(frozen=True, slots=True)
class Member:
    """One vehicle's value, the mean of its flights, with its sigma."""

    vehicle: str
    value: float
    sigma: float


@dataclass(frozen=True, slots=True)
class Common:
    """A number that vehicles of a type share.

    Attributes:
        name: ``antenna_x_m`` (beside what is told), ``gps_delay_s``, ``imu_delay_s``.
        unit: of it.
        of: the type of vehicle or the model of the receiver.
        members: at least three vehicles.
        shared: the mean and the scatter.
    """

    name: str
    unit: str
    of: str
    members: tuple[Member, ...]
    shared: Shared


@dataclass(frozen=True, slots=True)
class Comparison:
    """What is shared, out of how many numbers that three vehicles or more know."""

    common: tuple[Common, ...]
    looked_at: int


Value = tuple[str, str, str, str, float, float]
"""Name, unit, type, vehicle, value, sigma."""


def common_of(vehicles: Sequence[Vehicle]) -> Comparison:
    """What is shared at all, with one false alarm for everything that was looked at."""
    groups: dict[tuple[str, str, str], dict[str, list[tuple[float, float]]]] = {}
    for vehicle in vehicles:
        for name, unit, of, who, value, sigma in _values(vehicle):
            groups.setdefault((name, unit, of), {}).setdefault(who, []).append((value, sigma))
    asked = []
    for (name, unit, of), by_vehicle in groups.items():
        if len(by_vehicle) < FEWEST_VEHICLES:
            continue
        members = []
        for who, its in by_vehicle.items():
            value, sigma = np.array(its).T
            members.append(Member(who, *pooled(value, sigma)))
        values, sigmas = (np.array([(m.value, m.sigma) for m in members])).T
        found = shared(values, sigmas, COMMON.get(name, 0.0))
        if found is not None:
            asked.append(Common(name, unit, of, tuple(members), found))
    allowed = SHARED_FALSE_ALARM / max(len(asked), 1)
    return Comparison(tuple(c for c in asked if c.shared.p_value <= allowed), len(asked))


def _values(vehicle: Vehicle) -> Iterator[Value]:
    """What one vehicle says of its type, flight by flight."""
    if vehicle.identified_by == RECORDING:  # several of these may be one vehicle
        return
    built = vehicle.type if vehicle.latest.provenance.model else ""
    for flight, imu in first_heard(vehicle):
        receiver = flight.record.provenance.receiver
        for name, of in ((LATENCY, receiver), (ATTITUDE, built)):
            estimate = imu.calibration.timing.get(name)
            if estimate is not None and of and estimate.sigma > 0.0:
                yield name, "s", of, vehicle.name, estimate.value, estimate.sigma
        if imu.antenna is None or not built:
            continue
        for name, value, sigma in zip(ANTENNA, imu.antenna.value, imu.antenna.sigma, strict=True):
            if value is not None and sigma is not None:
                yield name, "m", built, vehicle.name, value, sigma
