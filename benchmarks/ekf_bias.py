"""Against the autopilot's own: EKF3's accelerometer bias, from the DataFlash log of the flight.

EKF3 estimates three biases per core (one core for each accelerometer) and no scale.  What counts
for either is how wrong the specific force is that is left: both are applied to the same samples of
the moving flight, and compared with what the true calibration makes of them.  The bias is taken as
it was at each moment; this estimator's answer is that of the whole flight.
"""

from __future__ import annotations

import numpy as np

from benchmarks.recorded import (
    WHERE,
    Array,
    Flight,
    clean,
    fed,
    in_force,
    moving_span,
    recorded,
)
from onboard.core.estimate.result import Calibration
from onboard.core.inputs.samples import EkfBias, ImuSample

SETTLED_S = 60.0
"""A filter is given this long to learn before it is judged."""


def force(flight: Flight, imu: int) -> tuple[Array, Array]:
    """(n,) times and (n, 3) specific force as reported, of the moving flight after SETTLED_S."""
    begin, end = moving_span(flight.samples)
    kept = [
        (s.t, *s.f_b)
        for s in flight.samples
        if isinstance(s, ImuSample) and s.imu == imu and begin + SETTLED_S < s.t < end
    ]
    rows = np.array(kept)
    return rows[:, 0], rows[:, 1:]


def bias_at(flight: Flight, core: int, t: Array) -> Array | None:
    """(n, 3) what the EKF's core subtracts at times ``t``; None if it is not in the log."""
    known = [s for s in flight.samples if isinstance(s, EkfBias) and s.core == core]
    if not known:
        return None
    times, values = np.array([s.t for s in known]), np.array([s.bias_b for s in known])
    latest = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 1)
    out: Array = values[latest]
    return out


def _rms(x: Array) -> Array:
    out: Array = np.sqrt(np.mean(x**2, axis=0))
    return out


def left_over(flight: Flight, c: Calibration) -> tuple[Array, Array, Array] | None:
    """(3,) RMS errors, m/s^2: as reported, less the EKF's bias, by this calibration."""
    held, truth = in_force(flight, c.imu), flight.truth[c.imu]
    t, reported = force(flight, c.imu)
    bias = bias_at(flight, c.imu - 1, t)
    if bias is None:
        return None
    raw = reported / held[:3] + held[3:]
    true = truth[:3] * (raw - truth[3:])
    ours = np.array(c.scale) * (raw - np.array(c.offset))
    return _rms(reported - true), _rms(reported - bias - true), _rms(ours - true)


def main(arguments: list[str] | None = None) -> None:
    """Print the comparison for each log that has the EKF's bias, or why there is none."""
    del arguments
    logs = [f for f in clean() if f.suffix == ".BIN"]
    if not logs:
        print(WHERE)
        return
    print(f"{'RMS error of the specific force, m/s^2':44}{'x':>9}{'y':>9}{'z':>9}{'ratio':>9}")
    for log in logs:
        flight = recorded(log)
        made = fed(flight.samples)
        for imu in made.imus:
            found = left_over(flight, made.calibration(imu))
            if found is None:
                print(f"{log.name} #{imu}: no EKF bias in the log")
                continue
            best = float(np.sqrt(np.sum(found[2] ** 2)))
            for what, e in zip(("as reported", "EKF3 bias", "onboard"), found, strict=True):
                ratio = float(np.sqrt(np.sum(e**2))) / best
                print(
                    f"{log.name + f' #{imu}':12}{what:32}"
                    f"{e[0]:9.4f}{e[1]:9.4f}{e[2]:9.4f}{ratio:9.1f}"
                )


if __name__ == "__main__":
    main()
