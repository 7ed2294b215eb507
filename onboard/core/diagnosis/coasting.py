"""What the inertia says of fixes that were refused in flight: a filter coasts and is asked of each.

The EKF's complaints and the receiver's own reports close the trust window; that is an opinion.
Where the velocity from before, carried on by the accelerometer, contradicts the fixes by more
than both can err, they were false.  The drift of the inertia is known where GPS comes back and
agrees: it is taken out in proportion to time, as the bridge between two known ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import (
    FAULT_M_S,
    FEWEST_FIXES,
    MEAN_S,
    SAME,
)
from onboard.core.diagnosis.refusals import Refused, within
from onboard.core.filter.innovations import Epoch, WhitenedInnovations
from onboard.core.filter.limits import ATTITUDE_TIME_S, COLOUR_TIME_S, GATE_VELOCITY
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.traces import EpochTrace, Traces
from onboard.core.filter.uncertainty import Uncertainty
from onboard.core.filter.whitening import Uses, WhiteningFilter
from onboard.core.inputs.limits import LONGEST_FIX_GAP_S
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY


@dataclass(frozen=True, slots=True)
class Asked:
    """One refused fix: its innovation (2,), and the covariance (2, 2) of what is expected of it."""

    t: float
    innovation: Array
    spread: Array


@dataclass(frozen=True, slots=True)
class Contradiction:
    """Refused fixes that inertia contradicts: mean error (2,) NE, its size and sigma, m/s."""

    start: float
    end: float
    off: Array
    size: float
    sigma: float


class AskingFilter(WhiteningFilter):
    """Notes what it expects of the fixes that it must not use."""

    def __init__(self, unknowns: int, levels: NoiseLevels, uses: Uses) -> None:
        """Take the number of unknowns, the noise levels and the measurements to use."""
        super().__init__(unknowns, (levels,), uses)
        self.asked: list[Asked] = []

    def update(
        self, epoch: Epoch, theta: Array, uncertainty: Uncertainty
    ) -> WhitenedInnovations | None:
        """As ever; a fix that is not to be believed is compared before."""
        expected = None if epoch.trusted else self.expected_velocity(epoch, theta, uncertainty)
        if expected is not None:
            innovation, spread = expected
            self.asked.append(Asked(epoch.t, innovation[:2], spread[:2, :2]))
        return super().update(epoch, theta, uncertainty)


def contradictions(
    full: Examination, levels: NoiseLevels, doubted: Sequence[Refused]
) -> list[Contradiction]:
    """Where the flight's inertia contradicts fixes that were refused.

    Args:
        full: of the flight, with a solution.
        levels: noise of the receiver where it was believed.
        doubted: refused for what others say of a receiver that has a fix.
    """
    if not doubted:
        return []
    asked, traces = _coasted(full, levels)
    spans = [(r.start, r.end) for r in doubted]
    inside = within(full.point.stamp(np.array([a.t for a in asked])), spans)
    out = []
    for group in _groups([a for a, is_in in zip(asked, inside, strict=True) if is_in]):
        flown = _with_before(group, traces)
        y, S, anchored = _bridged(group, traces)
        found = _between_steps(flown, levels, anchored=anchored)
        if not found and anchored:
            found = [*_runs([a.t for a in group], y, S, levels.velocity)]
        out += found
    return out


def _coasted(full: Examination, levels: NoiseLevels) -> tuple[list[Asked], Traces]:
    """Refused fixes compared, and all epochs as found, by a filter that coasts for any time."""
    solution = full.found()
    made = Pass(
        full.model,
        full.point,
        (levels,),
        uses=full.uses,
        traces=True,
        theta=solution.theta,
        covariance=solution.covariance,
    )
    made.filter = asking = AskingFilter(full.model.size, levels, made.uses)
    traces = Traces(sum(len(b.fixes) for b in full.batches))
    for batch in full.batches:
        if batch.fresh:
            made.restart()
        result = made.process(batch.segment, batch.fixes, batch.trusted)
        traces.extend(result.traces.at(solution.theta))
    return asking.asked, traces


def _groups(asked: Sequence[Asked]) -> Iterator[list[Asked]]:
    """Those that follow on each other: a filter that began anew has other errors."""
    cuts = [
        i + 1 for i, (a, b) in enumerate(pairwise(asked)) if not 0 < b.t - a.t < LONGEST_FIX_GAP_S
    ]
    for i, j in pairwise([0, *cuts, len(asked)]):
        if j - i >= FEWEST_FIXES:
            yield list(asked[i:j])


def _bridged(group: Sequence[Asked], traces: Iterable[EpochTrace]) -> tuple[Array, Array, bool]:
    """Innovations (n, 2) and covariances (n, 2, 2) less the drift that the end shows, if it does.

    Of a random walk that is known at both ends, a share ``1 - s`` of the variance is left where the
    share ``s`` of the time has passed; of anything steadier, less.
    """
    t = np.array([a.t for a in group])
    y, S = np.array([a.innovation for a in group]), np.array([a.spread for a in group])
    back = next((x for x in traces if x.t > t[-1] and _velocity(x) is not None), None)
    start = max((x.t for x in traces if x.t < t[0] and x.velocities), default=float(t[0]))
    end = None if back is None or back.t - t[-1] > LONGEST_FIX_GAP_S else _velocity(back)
    if back is None or end is None or _chi2(end, S[-1]) > GATE_VELOCITY:
        return y, S, False
    share = ((t - start) / (back.t - start))[:, None]
    return y - share * end, S * (1.0 - share[..., None]) + S[0] * share[..., None], True


def _velocity(x: EpochTrace) -> Array | None:
    """Innovation (2,) of a fix that was to be believed; None without one."""
    if x.velocities:
        return x.innovation[:2]
    return x.refused_by[:2] if len(x.refused_by) else None


def _chi2(y: Array, S: Array) -> float:
    return float(y @ np.linalg.solve(S, y))


def _with_before(group: Sequence[Asked], traces: Iterable[EpochTrace]) -> tuple[Array, Array]:
    """Times (n,) and innovations (n, 2) of a group and of the seconds right before it."""
    first = group[0].t
    near = [x for x in traces if first - 2.0 * LONGEST_FIX_GAP_S <= x.t < first]
    before = [(x.t, v) for x in near if (v := _velocity(x)) is not None]
    every = [*before, *((a.t, a.innovation) for a in group)]
    return np.array([t for t, _ in every]), np.array([v for _, v in every])


def _between_steps(
    flown: tuple[Array, Array], levels: NoiseLevels, *, anchored: bool
) -> list[Contradiction]:
    """Errors that come and go within a second, as the inertia cannot.

    How far the inertia has drifted by then does not matter: the error is what the velocity jumps
    by.  Counted from the flight before, or, where it has crept in before the first step, back from
    where GPS is right again.
    """
    t, y = flown
    steps, sigma = _steps(t, y, levels)
    error = np.cumsum([np.zeros(2), *(step for _, step in steps)], axis=0)
    if steps and anchored and not _small(error[-1], sigma * np.sqrt(len(steps))):
        n, first = _of_a_second(t), steps[0][0]
        if not _small(y[first - n : first].mean(axis=0) - y[:n].mean(axis=0), sigma):
            error -= error[-1]
        elif len(steps) > 1:  # what is left over is what the inertia has drifted meanwhile
            at = t[[first, *(k for k, _ in steps)]]
            error -= ((at - at[0]) / (at[-1] - at[0]))[:, None] * error[-1]
    edges = [0, *(k for k, _ in steps), len(t)]
    out = []
    for k, (i, j) in enumerate(pairwise(edges)):
        if j - i >= FEWEST_FIXES and not _small(error[k], sigma * np.sqrt(max(k, 1))):
            size = float(np.linalg.norm(error[k]))
            out.append(Contradiction(float(t[i]), float(t[j - 1]), error[k], size, sigma))
    return out


def _small(error: Array, sigma: float) -> bool:
    """Whether an error (2,) is chance, or no more than a receiver's ordinary one."""
    size = float(np.linalg.norm(error))
    return size < FAULT_M_S or size**2 < GATE_VELOCITY * sigma**2


def _steps(t: Array, y: Array, levels: NoiseLevels) -> tuple[list[tuple[int, Array]], float]:
    """Jumps between means over a second to either side: (index, (2,) m/s); and their sigma, m/s.

    What goes on growing the second before or after is no jump: that is an inertia that is lost.
    """
    n = _of_a_second(t)
    # What a tilt that GPS has corrected until then grows by.
    tilt = levels.attitude * np.sqrt(2.0 * MEAN_S / ATTITUDE_TIME_S)
    variance = (
        2.0 * levels.velocity**2 / n
        + 2.0 * levels.velocity_colour**2 * (1.0 - np.exp(-MEAN_S / COLOUR_TIME_S))
        + levels.force_walk**2 * MEAN_S
        + (STANDARD_GRAVITY * tilt * MEAN_S) ** 2
    )
    sigma = float(np.sqrt(variance))
    jump = np.zeros_like(y)
    for k in range(n, len(t) - n + 1):
        if t[k + n - 1] - t[k - n] < 3.0 * MEAN_S:
            jump[k] = y[k : k + n].mean(axis=0) - y[k - n : k].mean(axis=0)
    out: list[tuple[int, Array]] = []
    size = np.linalg.norm(jump, axis=1)
    left = size.copy()
    while len(left) and not _small(jump[k := int(np.argmax(left))], sigma):
        beside = max(size[max(k - n, 0)], size[min(k + n, len(size) - 1)])
        left[max(k - n, 0) : k + n + 1] = 0.0
        if beside < SAME * size[k]:
            out.append((k, jump[k]))
    return sorted(out, key=lambda step: step[0]), sigma


def _of_a_second(t: Array) -> int:
    """How many of the fixes at ``t`` make up :data:`MEAN_S`."""
    return max(round(MEAN_S / float(np.median(np.diff(t)))), 1) if len(t) > 1 else 1


def _runs(t: Sequence[float], y: Array, S: Array, white: float) -> Iterator[Contradiction]:
    """Stretches whose means over a second are impossible, and steady enough to be one error."""
    for i, j in _impossible(np.array(t), y, S, white):
        off = np.median(y[i:j], axis=0)
        size = float(np.linalg.norm(off))
        scatter = float(np.sqrt(np.mean(np.sum((y[i:j] - off) ** 2, axis=1))))
        if size > FAULT_M_S and scatter < SAME * size:
            drift = np.trace(S[i:j].mean(axis=0)) / 2.0 - white**2
            sigma = np.hypot(np.sqrt(max(drift, 0.0)), scatter / np.sqrt(j - i))
            yield Contradiction(t[i], t[j - 1], off, size, float(sigma))


def _impossible(t: Array, y: Array, S: Array, white: float) -> Iterator[tuple[int, int]]:
    """First and last (excluded) of those in a row whose means are beyond the filter's gate."""
    far = np.zeros(len(t) + 2, dtype=bool)
    for k, at in enumerate(t):
        near = np.abs(t - at) <= 0.5 * MEAN_S
        less = white**2 * (1.0 - 1.0 / int(near.sum())) * np.eye(2)
        far[k + 1] = _chi2(y[near].mean(axis=0), S[k] - less) > GATE_VELOCITY
    edges = np.flatnonzero(np.diff(far.astype(int)))
    for i, j in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if j - i >= FEWEST_FIXES and t[j - 1] - t[i] >= MEAN_S:
            yield i, j
