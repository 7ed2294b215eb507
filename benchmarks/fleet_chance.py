"""What is said of a fleet by chance, and what is found: simulated flights and vehicles.

``python -m benchmarks.fleet_chance`` takes some minutes.  Sigmas of flights differ by a factor of
four, flights are strewn over a hundred days.
"""

from __future__ import annotations

import argparse

import numpy as np

from onboard.core.fleet.course import Course, Series, follow
from onboard.core.fleet.shared import shared

SHARED_FALSE_ALARM = 0.01


def series(
    rng: np.random.Generator, n: int, scale: float = 1.0, step: float = 0.0, drift: float = 0.0
) -> tuple[Series, int]:
    """A series, and the flight after which it steps (by ``step`` sigma of a flight of one)."""
    wide = step == 0.0 and drift == 0.0
    sigma = rng.uniform(0.5, 2.0, n) if wide else rng.uniform(0.8, 1.2, n)
    day, after = np.sort(rng.uniform(0.0, 100.0, n)), int(rng.integers(1, n - 2)) if n > 3 else 0
    value = scale * sigma * rng.standard_normal(n) + drift * day + step * (np.arange(n) > after)
    return Series(value, sigma, day), after


def said(course: Course) -> bool:
    """Whether anything is said."""
    return bool(course.steps or course.odd or course.drifts)


def alarms(rng: np.random.Generator, count: int) -> None:
    """Print how often something is said where there is nothing."""
    for scale in (1.0, 1.5, 2.0):
        for n in (2, 4, 8, 12, 30):
            found = sum(said(follow(series(rng, n, scale)[0])) for _ in range(count))
            print(f"scatter {scale} times the claim, {n:2} flights: {100 * found / count:.2f} %")


def power(rng: np.random.Generator, count: int) -> None:
    """Print how often a step of five sigma of a flight is found, at its place."""
    for n in (5, 8, 12, 30):
        found = right = 0
        for _ in range(count):
            its, after = series(rng, n, step=5.0)
            steps = follow(its).steps
            found += len(steps) == 1
            right += len(steps) == 1 and steps[0].first <= after <= steps[0].last
        print(f"step of 5 sigma, {n:2} flights: {100 * found / count:.0f} % found, "
              f"{100 * right / max(found, 1):.0f} % of these at their place")  # fmt: skip


def trends(rng: np.random.Generator, count: int) -> None:
    """Print how often the drift is within two sigma, and how often it is said."""
    for drift in (0.0, 0.02, 0.05, 0.2):
        for n in (5, 8, 12, 30):
            courses = [follow(series(rng, n, drift=drift)[0]) for _ in range(count)]
            sized = [c.trend for c in courses if c.trend is not None]
            inside = sum(abs(t.size - drift) < 2.0 * t.sigma for t in sized)
            print(f"drift of {100 * drift:2.0f} sigma in all, {n:2} flights: "
                  f"{100 * inside / len(sized):.1f} % within two sigma, "
                  f"{100 * sum(c.drifts for c in courses) / count:.0f} % said")  # fmt: skip


def types(rng: np.random.Generator, count: int) -> None:
    """Print how often something is shared that is not."""
    for k in (3, 5, 10, 20):
        for between in (0.0, 0.5, 1.0, 3.0):
            found = 0
            for _ in range(count):
                sigma = rng.uniform(0.3, 2.0, k)
                value = rng.normal(0.0, between, k) + sigma * rng.standard_normal(k)
                its = shared(value, sigma)
                found += its is not None and its.p_value <= SHARED_FALSE_ALARM
            print(f"{k:2} vehicles that scatter by {between}: {100 * found / count:.2f} % shared")


def main() -> None:
    """Print everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="of each")
    parser.add_argument("--seed", type=int, default=1)
    told = parser.parse_args()
    rng = np.random.default_rng(told.seed)
    for part in (alarms, power, trends, types):
        part(rng, told.count)


if __name__ == "__main__":
    main()
