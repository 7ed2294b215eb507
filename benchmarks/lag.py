"""GPS latency: this estimator against the usual way to find it from a log.

The usual way (pymavlink's tool ``mavgpslag`` does it, in steps of one inertial sample): turn the
accelerometer by the recorded attitude, add gravity, and take the lag at which its sums between
fixes are, in the mean of their absolute differences, closest to the changes of GPS velocity.  Here
it runs on the same recordings with steps of 1 ms, with inertial times corrected for the declared
low-pass, and without its threshold on speed, all to its advantage.  (The tool itself is not in
pymavlink's package and reads DataFlash only.)
"""

from __future__ import annotations

import numpy as np

from benchmarks.error_state import streams
from benchmarks.recorded import WHERE, Array, Flight, clean, fed, recorded
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import rotation_from_euler

LAGS = np.arange(-0.1, 0.5, 0.001)


def by_correlation(flight: Flight) -> float:
    """Lag (s) at which sums of accelerometer and changes of GPS velocity agree best."""
    s = streams(flight)
    t, force = s.imu[:, 0], s.imu[:, 1:4]
    roll, pitch, yaw = (
        np.interp(t, s.attitude[:, 0], np.unwrap(s.attitude[:, i])) for i in (1, 2, 3)
    )
    a_n = np.einsum("kij,kj->ki", rotation_from_euler(roll, pitch, yaw), force)
    a_n[:, 2] += STANDARD_GRAVITY
    step = np.diff(t)[:, None]
    v_n = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * step * (a_n[1:] + a_n[:-1]), axis=0)])
    fixes = s.fixes[(s.fixes[:, 0] > t[0] + LAGS[-1]) & (s.fixes[:, 0] < t[-1] + LAGS[0])]
    change = np.diff(fixes[:, 4:6], axis=0)
    cost = [_mismatch(t, v_n, fixes[:, 0] - lag, change) for lag in LAGS]
    return float(LAGS[int(np.argmin(cost))])


def _mismatch(t: Array, v_n: Array, at: Array, change: Array) -> float:
    there = np.stack([np.interp(at, t, v_n[:, j]) for j in (0, 1)], axis=-1)
    return float(np.mean(np.abs(np.diff(there, axis=0) - change)))


def main(arguments: list[str] | None = None) -> None:
    """Print errors of the latency on every clean stream."""
    del arguments
    files = [f for f in clean() if f.suffix == ".tlog"]
    if not files:
        print(WHERE)
        return
    print(f"{'recording':12}{'true, ms':>10}{'onboard':>10}{'by correlation':>16}   (errors, ms)")
    ours, theirs = [], []
    for file in files:
        flight = recorded(file)
        found = fed(flight.samples).calibration(1).timing["gps_delay_s"].value
        ours.append(1e3 * (found - flight.delay))
        theirs.append(1e3 * (by_correlation(flight) - flight.delay))
        print(f"{file.name:12}{1e3 * flight.delay:10.0f}{ours[-1]:10.1f}{theirs[-1]:16.1f}")
    a, b = (float(np.median(np.abs(x))) for x in (ours, theirs))
    print(f"{'median':12}{'':10}{a:10.1f}{b:16.1f}   ratio {b / a:.1f}")


if __name__ == "__main__":
    main()
