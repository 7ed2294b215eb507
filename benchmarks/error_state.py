"""Against an error-state filter: pyins, with accelerometer bias and scale states, same recordings.

pyins (PyPI: python-ins) is an optional extra, ``bench``; without it this part says so.  Its filter
knows neither latency nor noise levels, so it runs twice: on the stamps as they are, and with the
true latency taken off them, which it could not have known.  Gyroscope bias and scale are states of
it too; noise is set to what suits these recordings.  Both see the same samples.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.recorded import (
    WHERE,
    Array,
    Flight,
    answered,
    error_of,
    fed,
    folder,
    in_force,
    limits,
    moving_span,
    recorded,
)
from onboard.core.inputs.parameters import filter_delay
from onboard.core.inputs.samples import FIX_3D, AttitudeSample, GpsFix, ImuSample, ImuSource
from onboard.core.maths.earth import STANDARD_GRAVITY

if TYPE_CHECKING:
    from pandas import DataFrame
    from pyins.measurements import Measurement

RECORDINGS = ("a02.tlog", "b02.tlog", "c01.BIN")
BEFORE_S = 8.0
"""Start of the filter before the vehicle first moves."""
IMU_DELAY = filter_delay(20.0)

VELOCITY_SD, HEIGHT_SD, POSITION_SD = 0.1, 0.3, 1.0
ACCEL_NOISE, GYRO_NOISE = 0.03, 3e-4


@dataclass(frozen=True, slots=True)
class Streams:
    """Arrays of one flight from shortly before it moves: what an offline filter asks for."""

    imu: Array
    attitude: Array
    fixes: Array
    vertical: bool


def streams(flight: Flight) -> Streams:
    """(n, 7) time, force, rate; (k, 4) time, roll, pitch, yaw; (m, 7) time, lla, velocity."""
    begin = moving_span(flight.samples)[0] - BEFORE_S
    sources = {s.source for s in flight.samples if isinstance(s, ImuSample) and s.imu == 1}
    best = ImuSource.HIGHRES_IMU if ImuSource.HIGHRES_IMU in sources else min(sources, key=str)
    imu, attitude, fixes = {}, {}, {}
    vertical = True
    for s in flight.samples:
        if isinstance(s, ImuSample) and s.imu == 1 and s.source is best and s.t > begin:
            half = 0.5 * s.f_step
            force = [x + np.sign(x) * half for x in s.f_b]
            turn = [x + np.sign(x) * 0.5 * s.w_step for x in s.w_b or (0.0, 0.0, 0.0)]
            imu[s.t - IMU_DELAY] = [*force, *turn]
        elif isinstance(s, AttitudeSample) and s.t > begin:
            attitude[s.t] = [s.roll, s.pitch, s.yaw]
        elif isinstance(s, GpsFix) and s.t > begin and s.fix_type >= FIX_3D:
            vertical &= s.v_d is not None
            fixes[s.t] = [s.latitude, s.longitude, s.altitude, s.v_n, s.v_e, s.v_d or 0.0]
    return Streams(_rows(imu), _rows(attitude), _rows(fixes), vertical)


def _rows(by_time: dict[float, list[float]]) -> Array:
    return np.array([[t, *by_time[t]] for t in sorted(by_time)])


def pyins_six(s: Streams, force: Array, delay: float) -> Array:
    """(6,) scale and offset that pyins' feedback filter ends with.

    Args:
        s: the flight.
        force: (6,) scale and offset in force.
        delay: taken off the fixes' stamps, s.
    """
    import pandas as pd
    from pyins import filters, inertial_sensor, strapdown

    fixes = _where_gravity_agrees(s, delay)
    gps = pd.DataFrame(
        fixes[:, 1:], index=fixes[:, 0], columns=["lat", "lon", "alt", "VN", "VE", "VD"]
    )
    imu = pd.DataFrame(
        np.hstack([s.imu[:, 4:], s.imu[:, 1:4]]),
        index=s.imu[:, 0],
        columns=["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"],
    )
    imu = imu.loc[fixes[0, 0] :]
    start = float(imu.index[0])
    angles = [
        np.degrees(np.interp(start, s.attitude[:, 0], np.unwrap(s.attitude[:, i])))
        for i in (1, 2, 3)
    ]
    pva = pd.Series(
        [*fixes[0, 1:4], *fixes[0, 4:], *angles],
        index=["lat", "lon", "alt", "VN", "VE", "VD", "roll", "pitch", "heading"],
        name=start,
    )
    accel = inertial_sensor.EstimationModel(
        bias_sd=0.5, noise=ACCEL_NOISE, scale_misal_sd=np.diag([0.03] * 3)
    )
    gyro = inertial_sensor.EstimationModel(
        bias_sd=0.01, noise=GYRO_NOISE, bias_walk=3e-5, scale_misal_sd=np.diag([0.01] * 3)
    )
    result = filters.run_feedback_filter(
        pva, 1.0, 0.5, 2.0, 5.0,
        strapdown.compute_increments_from_imu(imu, "rate"),
        gyro, accel, _measured(gps, vertical=s.vertical), time_step=0.2,
    )  # fmt: skip
    last = result.accel.iloc[-1]
    bias = np.array([last[f"bias_{a}"] for a in "xyz"])
    gain = 1.0 + np.array([last[f"sm_{a}{a}"] for a in "xyz"])
    return np.concatenate([force[:3] / gain, force[3:] + bias / force[:3]])


def _where_gravity_agrees(s: Streams, delay: float) -> Array:
    """(m, 7) fixes with inertial samples around them, degrees; ``delay`` is taken off the stamps.

    Its gravity is the earth's, the recordings' is constant: heights go to where both agree.
    """
    from pyins import earth

    fixes = s.fixes.copy()
    fixes[:, 0] -= delay
    fixes[:, 1:3] = np.degrees(fixes[:, 1:3])
    here = float(earth.gravity(fixes[0, 1], 0.0))
    slope = float(earth.gravity(fixes[0, 1], 1.0)) - here
    fixes[:, 3] += (STANDARD_GRAVITY - here) / slope - fixes[0, 3]
    known = (fixes[:, 0] > s.imu[1, 0] + 0.1) & (fixes[:, 0] < s.imu[-1, 0])
    out: Array = fixes[known]
    return out


def _measured(gps: DataFrame, *, vertical: bool) -> list[Measurement]:
    """Velocity and position; GPS_RAW_INT's velocity has no vertical component."""
    from pyins import measurements

    velocity = measurements.NedVelocity(gps, VELOCITY_SD)
    position = measurements.Position(gps, HEIGHT_SD if vertical else POSITION_SD)
    return [velocity if vertical else _Horizontal(velocity), position]


class _Horizontal:
    """A measurement of velocity without its vertical component, as pyins' filters ask for one."""

    def __init__(self, velocity: Measurement) -> None:
        self._velocity = velocity
        self.data = velocity.data

    def compute_matrices(self, *where: object) -> tuple[Array, ...] | None:
        """Innovation, Jacobian and covariance; None where nothing was measured."""
        found = self._velocity.compute_matrices(*where)
        return None if found is None else (found[0][:2], found[1][:2], found[2][:2, :2])


def _line(name: str, what: str, error: Array, limit: Array, spent: float, unit: float) -> str:
    e = np.abs(error)
    return (
        f"{name:10}{what:24}{e[:3].max():9.4f}{e[3:5].max():9.3f}{e[5]:9.3f}"
        f"{(e / limit).max():10.2f}{spent:8.1f}{spent / unit:8.1f}"
    )


def lines(names: Sequence[str]) -> Iterator[str]:
    """A block of three for each recording: this estimator, and the other one twice."""
    heads = f"{'scale':>9}{'xy offs.':>9}{'z offs.':>9}{'of limit':>10}{'CPU s':>8}{'ratio':>8}"
    yield f"{'':34}{heads}"
    for name in names:
        if name.split(".")[0] not in answered():
            continue
        flight = recorded(folder() / name)
        force, limit = in_force(flight, 1), limits(flight.vehicle)
        one = [s for s in flight.samples if not isinstance(s, ImuSample) or s.imu == 1]
        began = time.process_time()
        c = fed(one).calibration(1)
        ours = time.process_time() - began
        yield _line(name, "onboard", error_of(c, flight), limit, ours, ours)
        s = streams(flight)
        for what, delay in (("stamps as they are", 0.0), ("latency told", flight.delay)):
            began = time.process_time()
            error = pyins_six(s, force, delay) - flight.truth[1]
            spent = time.process_time() - began
            yield _line("", f"pyins, {what}", error, limit, spent, ours)


def main(arguments: list[str] | None = None) -> None:
    """Print the comparison, or why there is none."""
    parser = argparse.ArgumentParser(description="Against pyins' error-state filter.")
    parser.add_argument("recordings", nargs="*", default=RECORDINGS, help="files' names")
    chosen = parser.parse_args(arguments)
    if not answered():
        print(WHERE)
        return
    try:
        import pyins  # noqa: F401 - whether it is there
    except ImportError:
        print("pyins is not installed (extra: bench), skipped")
        return
    with warnings.catch_warnings():
        # Another project's deprecations are not ours to report.
        warnings.simplefilter("ignore")
        for line in lines(chosen.recordings):
            print(line, flush=True)


if __name__ == "__main__":
    main()
