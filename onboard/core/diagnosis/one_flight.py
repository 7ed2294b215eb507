"""Whether recordings that are explained as one flight can be one: timing and antenna of each.

One flight has one latency, one averaging, one delay of the attitude and one place of the antenna.
Where recordings differ in them, an effect that does not exist makes up for it: a clock that runs
off, an averaging, an antenna between two places.  So what each says by itself is compared, with the
model that was chosen for all: the sums of its blocks give a Gaussian of all unknowns, of which
those of timing and antenna are kept, the prior taken out.  Each recording is compared with those
before it, as flights are (:mod:`onboard.core.estimate.merged_flights`): what values of its own gain
is chi-square, with as many degrees of freedom as there are directions that both know.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.limits import ANTENNA_FLOOR_M
from onboard.core.estimate.calibration_model import antenna_of
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.limits import TIMING_FLOOR_S
from onboard.core.estimate.merged_flights import Apart, Normal, apart_of
from onboard.core.estimate.solution import Solution, solve
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block

TIMES = ("gps_delay", "window_squared", "attitude_delay", "clock_rate")
SHOWN_SIGMAS = 3.0
"""Of a difference that is named: 0.3 % come so far by chance [probability]."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One thing that two recordings say differently: values and sigmas, s or m."""

    what: str
    unit: str
    before: tuple[float, float]
    now: tuple[float, float]

    @property
    def sigmas(self) -> float:
        """How far apart they are, in sigmas of the difference."""
        return abs(self.now[0] - self.before[0]) / math.hypot(self.now[1], self.before[1])


@dataclass(frozen=True, slots=True)
class Contradiction:
    """Recordings that are no one flight.

    Attributes:
        recording: the first that contradicts those before it.
        before: the one before it with flight.
        apart: of all up to it.
        differences: from the one before, the largest first.
    """

    recording: int
    before: int
    apart: Apart
    differences: tuple[Difference, ...]


def contradiction(engine: Engine, begins: Sequence[float]) -> Contradiction | None:
    """The first recording that contradicts those before it in timing or antenna; None: none does.

    Args:
        engine: whose model was chosen for all of them, with their sums.
        begins: when each recording begins, s, on the clock of the engine.
    """
    each: list[list[Block]] = [[] for _ in begins]
    for block in engine.all_blocks:
        each[max(int(np.searchsorted(begins, block.end, side="right")) - 1, 0)].append(block)
    flown = [(k, blocks) for k, blocks in enumerate(each) if blocks]
    so_far: Normal | None = None
    seen: list[tuple[int, Solution, float]] = []
    apart = Apart(0.0, 0)
    for k, blocks in flown:
        found = solve(blocks, engine.model)
        said = _said(engine, found)
        middle = (blocks[0].start + blocks[-1].end) / 2.0
        if so_far is not None:
            more = apart_of(said, so_far)
            apart = Apart(apart.chi_square + more.chi_square, apart.dof + more.dof)
        if apart.contradicted:
            before, then, its = seen[-1]
            differences = _differences(_shown(engine, then, its), _shown(engine, found, middle))
            return Contradiction(k, before, apart, differences)
        so_far = said if so_far is None else so_far + said
        seen.append((k, found, middle))
    return None


def _said(engine: Engine, found: Solution) -> Normal:
    """Timing and antenna of one recording, in units of their prior and without it."""
    model, point = engine.model, engine.point
    times = [model.index[n] for n in TIMES if n in model.index]
    which = [*times, *range(*antenna_of(model).indices(model.size))]
    of_square = TIMING_FLOOR_S * 2.0 * max(point.window, TIMING_FLOOR_S)
    floors = {"window_squared": of_square, "clock_rate": 0.0}
    floor = np.full(len(which), ANTENNA_FLOOR_M)
    floor[: len(times)] = [floors.get(n, TIMING_FLOOR_S) for n in TIMES if n in model.index]
    unit = model.prior_sigma[which]
    P = (found.covariance[np.ix_(which, which)] + np.diag(floor**2)) / np.outer(unit, unit)
    information = np.linalg.inv(P)
    b = information @ ((found.theta[which] - model.prior[which]) / unit)
    # What says less than the prior says nothing: there the difference is rounding.
    size, V = np.linalg.eigh((information + information.T) / 2 - np.eye(len(which)))
    known = V[:, size > 0.0]
    return Normal((known * size[size > 0.0]) @ known.T, known @ (known.T @ b))


def _shown(engine: Engine, found: Solution, middle: float) -> list[tuple[str, str, float, float]]:
    """What, unit, value and sigma of what people know: the latency is that in the middle, s."""
    model, point, theta = engine.model, engine.point, found.theta
    out = []

    def tell(what: str, unit: str, taken: float, along: Array) -> None:
        sigma = math.sqrt(max(float(along @ found.covariance @ along), 0.0))
        out.append((what, unit, taken + float(along @ theta), sigma))

    one = np.eye(model.size)
    late, since = one[model.index["gps_delay"]], middle - point.skew_from
    if "clock_rate" in model.index:
        late = late + since * one[model.index["clock_rate"]]
    tell("the latency of GPS", "s", point.delay + point.skew * since, late)
    square = model.index["window_squared"]
    # Of a mean over a span its square is linear; as a span it is what people know.
    width = max(point.window, math.sqrt(max(point.window**2 + float(theta[square]), 0.0)))
    if width > 0.0:
        sigma = math.sqrt(float(found.covariance[square, square])) / (2.0 * width)
        window = math.sqrt(max(point.window**2 + float(theta[square]), 0.0))
        out.append(("the receiver's averaging", "s", window, sigma))
    delay = one[model.index["attitude_delay"]]
    tell("the delay of the attitude", "s", point.attitude_delay, delay)
    told = np.zeros(3) if engine.told is None else engine.told
    for axis, i, at in zip("xyz", range(model.size)[antenna_of(model)], told, strict=True):
        tell(f"the antenna's place along {axis}", "m", float(at), one[i])
    return out


def _differences(
    before: Sequence[tuple[str, str, float, float]], now: Sequence[tuple[str, str, float, float]]
) -> tuple[Difference, ...]:
    there = {what: (value, sigma) for what, _, value, sigma in before}
    every = [Difference(w, u, there[w], (v, s)) for w, u, v, s in now if w in there]
    every.sort(key=lambda d: -d.sigmas)
    return tuple(d for d in every if d.sigmas > SHOWN_SIGMAS) or tuple(every[:1])
