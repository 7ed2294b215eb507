"""How honest the sigmas are: many simulated flights with coloured GPS noise, counted.

For each of the six numbers: bias and RMS error, the mean claimed sigma, and how often the error
lies inside 1.96 sigma (95 % if the sigma is right).  Only numbers that the estimator itself calls
observed are counted; the others are listed as a share.  Gyroscopes are turned against their
accelerometers as far as those that one can buy are.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.limits import GYRO_CROSS_SIGMA
from onboard.core.estimate.result import SIX_NAMES, Status
from onboard.core.maths.arrays import vector3
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.recording import FlightSpec, fly_messages

Row = tuple[str, int, str, list[float], list[float], list[bool], float, float]


def one(job: tuple[Literal["copter", "plane"], int, float]) -> Row:
    """Fly, estimate, compare: errors and sigmas of the six, and of the latency."""
    vehicle, seed, duration = job
    rng = np.random.default_rng([seed, 7])
    gps = GpsTruth(delay=float(rng.uniform(0.06, 0.3)))
    turn = vector3(GYRO_CROSS_SIGMA * rng.standard_normal(3))
    truth = tuple(replace(imu, gyro_turn=turn) for imu in random_imus(seed))
    spec = FlightSpec(vehicle=vehicle, seed=seed, duration=duration, imus=truth, gps=gps)
    calibrator, decoder = Calibrator(), Decoder()
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            calibrator.feed(sample)
    calibrator.finish()
    c = calibrator.calibration(1)
    error = np.array(c.scale + c.offset) - np.array(truth[0].scale + truth[0].offset)
    delay = c.timing["gps_delay_s"]
    return (
        vehicle,
        seed,
        c.status.value,
        [float(x) for x in error],
        list(c.scale_sigma + c.offset_sigma),
        list(c.observable),
        delay.value - gps.net_delay,
        delay.sigma,
    )


def table(rows: list[Row]) -> list[str]:
    """Lines for people."""
    out = []
    for vehicle in ("copter", "plane"):
        mine = [r for r in rows if r[0] == vehicle]
        if not mine:
            continue
        e = np.array([r[3] for r in mine])
        s = np.array([r[4] for r in mine])
        seen = np.array([r[5] for r in mine])
        done = sum(r[2] == Status.CALIBRATED.value for r in mine)
        out.append(f"{vehicle}: {len(mine)} flights, {done} calibrated")
        out.append(f"  {'':10}{'bias':>9}{'rms':>9}{'sigma':>9}{'in 95 %':>9}{'observed':>10}")
        for i, name in enumerate(SIX_NAMES):
            k = seen[:, i]
            if not k.any():
                out.append(f"  {name:10}{'never observed':>20}")
                continue
            inside = np.mean(np.abs(e[k, i]) <= 1.96 * s[k, i])
            out.append(
                f"  {name:10}{e[k, i].mean():9.4f}{np.sqrt(np.mean(e[k, i] ** 2)):9.4f}"
                f"{s[k, i].mean():9.4f}{100 * inside:8.0f}%{100 * k.mean():9.0f}%"
            )
        d, ds = np.array([r[6] for r in mine]), np.array([r[7] for r in mine])
        out.append(
            f"  {'latency':10}{d.mean():9.4f}{np.sqrt(np.mean(d**2)):9.4f}{ds.mean():9.4f}"
            f"{100 * np.mean(np.abs(d) <= 1.96 * ds):8.0f}%"
        )
    return out


def flights(count: int, duration: float, first: int = 0) -> list[Row]:
    """Half copters, half planes."""
    jobs: list[Any] = [
        ("copter" if i % 2 == 0 else "plane", first + i, duration) for i in range(count)
    ]
    with ProcessPoolExecutor(max_workers=max(1, (os.cpu_count() or 2) - 1)) as pool:
        return list(pool.map(one, jobs))


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Coverage of the estimator's sigmas.")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--duration", type=float, default=240.0)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    chosen = parser.parse_args(arguments)
    for line in table(flights(chosen.count, chosen.duration, chosen.first)):
        print(line)


if __name__ == "__main__":
    main()
