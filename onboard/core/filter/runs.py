"""Many epochs in one call: the loop over steps and epochs that numba compiles.

What :class:`~onboard.core.filter.whitening.WhiteningFilter` does to an epoch of which a gate
refuses nothing, epoch after epoch, until one is not like that.  Equal to it to rounding, in all 18
states (:mod:`~onboard.core.filter.state`).
"""

from __future__ import annotations

import numpy as np

from onboard.core.filter.estimate_loops import add_to_estimate
from onboard.core.filter.limits import LEAST_VELOCITY_VAR
from onboard.core.filter.loops import measured, take, take_noise, whiten
from onboard.core.filter.motion import angle_of, carry, mean, turn_by
from onboard.core.filter.readings import Index
from onboard.core.filter.state import MEASURED, STATES
from onboard.core.filter.tail_loops import BY_INFORMATION, NOTHING, UNTOLD, tails_of, widen
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled, part


@part
def _symmetric(carried: Array, m1: int) -> None:
    """Covariances made symmetric, in place."""
    for b in range(len(carried)):
        P = carried[b, :, m1 : m1 + STATES]
        for i in range(STATES):
            for j in range(i):
                P[i, j] = P[j, i] = (P[i, j] + P[j, i]) / 2.0


@part
def _numbers(offered: Index) -> Index:
    """Which numbers an epoch has to offer: :func:`onboard.core.filter.readings.reading`."""
    v, h, a = offered[0], offered[1], offered[2]
    number = np.empty(v + h + 3 * a, dtype=np.int64)
    for i in range(v):
        number[i] = i
    if h:
        number[v] = 3
    for i in range(3 * a):
        number[v + h + i] = 4 + i
    return number


@part
def _spread(ned: Array, acting: Index, m1: int) -> Array:
    """What an epoch has in NED, (n, m1), from the columns that there are."""
    z = np.zeros((len(ned), m1))
    for i in range(len(ned)):
        for j in range(len(acting)):
            z[i, acting[j]] = ned[i, j]
    return z


@part
def _sum(
    white: Array, more: Array, jitter: Array, moving: Array, powers: Array, stated: float
) -> Array:
    """Variances (B, n) and what an epoch (n,) adds to them, as ``Variances.of_reading``."""
    out = np.empty(white.shape)
    for b in range(len(white)):
        as_stated = stated ** powers[b, 0]
        for i in range(len(more)):
            out[b, i] = white[b, i]
            if i < 3:
                least = min(out[b, i], LEAST_VELOCITY_VAR)
                out[b, i] = max(out[b, i] * as_stated, least)
            out[b, i] += more[i] + jitter[b] * moving[i]
    return out


@part
def _keep(
    W: Array,
    E: Array,
    var: Array,
    theta: Array,
    r: int,
    at: int,
    rows: Array,
    raw: Array,
    log_var: Array,
    left: Array,
) -> None:
    """Write down the r innovations of an epoch from row ``at`` on."""
    m1 = E.shape[1]
    for b in range(len(W)):
        for a in range(r):
            log_var[b, at + a] = var[b, a]
            for c in range(m1):
                rows[b, at + a, c] = W[b, a, c]
            x = W[b, a, 0]
            for c in range(len(theta)):
                x -= W[b, a, c + 1] * theta[c]
            left[b, at + a] = x
    for a in range(r):
        for c in range(m1):
            raw[at + a, c] = E[a, c]


@part
def _note(
    carried: Array, R_nb: Array, E: Array, velocities: int, theta: Array, state: Array
) -> None:
    """Turn the attitude by what was found, and write down what there is after the epoch."""
    psi = (mean(carried, 4, theta), mean(carried, 5, theta), mean(carried, 6, theta))
    turn_by(psi[0], psi[1], psi[2], R_nb)
    for i in range(3):
        for b in range(len(carried)):
            carried[b, 4 + i, 0] -= psi[i]
        state[i] = np.nan
    for i in range(velocities):
        x = E[i, 0]
        for c in range(len(theta)):
            x -= E[i, c + 1] * theta[c]
        state[i] = x
    for i in range(3):
        for j in range(3):
            state[3 + 3 * i + j] = R_nb[i, j]
        state[12 + i] = mean(carried, i, theta)


@compiled(
    "i8(f8[:,:,::1], f8[:,::1], i8[::1], i8, f8[::1], i8, f8[:,::1], i8[::1], f8[:,::1],"
    " f8[:,::1], i8[::1], f8[::1], f8[:,:,::1], f8[:,:,::1],"
    " f8[:,:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], i8[::1], i8[:,::1], f8[:,:,:],"
    " f8[:,:,::1], f8[:,:,::1], i8[::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[:,::1],"
    " f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[::1],"
    " f8[::1], f8, i8, i8, f8[::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1], i8[::1],"
    " f8[:,::1])"
)
def run(
    carried: Array,
    R_nb: Array,
    progress: Index,
    symmetry: int,
    theta: Array,
    held: int,
    known: Array,
    form: Index,
    summed: Array,
    prior: Array,
    counted: Index,
    duration: Array,
    turn: Array,
    moved: Array,
    columns: Array,
    missed: Array,
    shaken: Array,
    leads_to: Array,
    latitude: Array,
    ends: Index,
    offered: Index,
    R_attitude: Array,
    body: Array,
    ned: Array,
    acting: Index,
    along: Array,
    noise: Array,
    moving: Array,
    stated: Array,
    walk: Array,
    settled: Array,
    white: Array,
    jitter: Array,
    times: Array,
    heading_time: Array,
    powers: Array,
    shares: Array,
    tails: Array,
    since: Array,
    gravity: float,
    earth: int,
    noisy: int,
    gram: Array,
    rows: Array,
    raw: Array,
    log_var: Array,
    left: Array,
    taken: Index,
    states: Array,
) -> int:
    """Go on through steps and epochs while they are ordinary, in place.

    Args:
        carried: (B, STATES, C) as in :mod:`onboard.core.filter.kernel`.
        R_nb: (3, 3) attitude.
        progress: (4,) the step to go on with; numbers that were read; epochs that were taken;
            updates so far.
        symmetry: updates after which covariances are made symmetric.
        theta: (m,) estimate.
        held: whether it stays; else it, ``known`` and ``form`` are written to.
        known: (m, m) how well it is known: by its covariance, or by its information.
        form: (1,) which of the two, as of :mod:`~..tail_loops`.
        summed: (m + 1, m + 1) and prior and counted as in
            :class:`~..running_estimate.RunningEstimate`.
        prior: see there.
        counted: see there.
        duration: (K,), turn, moved, columns, missed and shaken as in :class:`~..innovations.Steps`.
        turn: see there.
        moved: see there.
        columns: see there.
        missed: see there.
        shaken: see there.
        leads_to: (K,) ``stated`` of the epoch that each step leads to.
        latitude: (n,) rad.
        ends: (K,) the epoch at the end of each step; -1: none.
        offered: (n, 4) components of velocity, of height, of attitude over three; what is known of
            the velocity: 0 nothing, 1 that it is not refused, 2 that it is.
        R_attitude: (n, 3, 3) and body, ned, acting, along, noise, moving and stated as in
            :class:`~..innovations.Epochs`.
        body: see there.
        ned: see there.
        acting: see there.
        along: see there.
        noise: see there.
        moving: see there.
        stated: see there.
        walk: (B, STATES) and settled, white and jitter as in :class:`~..variances.Variances`.
        settled: see there.
        white: see there.
        jitter: see there.
        times: (2,) of the slow errors of velocity and tilt, s.
        heading_time: (B,) of that of the heading, s.
        powers: (B, 2) of ``stated`` with which the velocity's variances go.
        shares: (B, 3) as ``shaken`` of :class:`~..variances.Variances`.
        tails: (4,) by degrees of freedom.
        since: (1,) s since something of an epoch was taken.
        gravity: m/s^2.
        earth: whether it turns.
        noisy: whether the noise in regressors is carried.
        gram: (3,) of it.
        rows: (B, .., m + 1) whitened innovations are written to.
        raw: (.., m + 1) those of member 0 before whitening.
        log_var: (B, ..) logarithms of their variances before whitening.
        left: (B, ..) what ``theta`` leaves of them.
        taken: (n,) epochs that were taken, in order, are written to.
        states: (n, 15) velocity innovation, attitude and velocity after each of them.

    Returns:
        1 if the step ``progress[0]`` was made, but the epoch at its end is out of the ordinary; 2
        if a covariance is none; else 0.
    """
    members, _, width = carried.shape
    m1 = columns.shape[2]
    turned = np.zeros(3)
    E, W = np.empty((MEASURED, m1)), np.empty((members, MEASURED, width))
    whitener, var = np.zeros((MEASURED, MEASURED)), np.empty((members, MEASURED))
    factor = np.empty(4)
    while progress[0] < len(duration):
        k = progress[0]
        e = ends[k]
        carry(
            carried,
            R_nb,
            duration[k],
            turn[k],
            moved[k],
            columns[k],
            missed[k],
            shaken[k],
            latitude[max(e, 0)],
            theta,
            walk,
            settled,
            times,
            heading_time,
            powers,
            shares,
            leads_to[k],
            gravity,
            earth,
        )
        since[0] += duration[k]
        if e < 0:
            progress[0] += 1
            continue
        number = _numbers(offered[e])
        r = len(number)
        if r == 0 or offered[e, 3] == 2:
            return 1
        turned[0] = turned[1] = turned[2] = 0.0
        if offered[e, 2]:
            angle_of(R_attitude[e], R_nb, turned)
        z = _spread(ned[e], acting, m1)
        measured(R_nb, body[e], along[e], mean(carried, 2, theta), turned, z)
        W[:, r:] = 0.0
        reads = _sum(white, noise[e], jitter, moving[e], powers, stated[e])
        if whiten(carried, z, number, reads, E, W, whitener, var):
            return 1
        tail = tails_of(W, theta, offered[e], tails, known, form[0], factor)
        if tail == UNTOLD:
            return 1
        if tail != NOTHING:
            widen(carried, m1, offered[e], factor, var, since[0], reads)
            if whiten(carried, z, number, reads, E, W, whitener, var):
                return 2
        take(carried, W, m1)
        if noisy:
            take_noise(carried[0], W[0], whitener, number, m1, gram)
        since[0] = 0.0
        progress[3] += 1
        if progress[3] % symmetry == 0:
            _symmetric(carried, m1)
        at, n = progress[1], progress[2]
        _keep(W, E, var, theta, r, at, rows, raw, log_var, left)
        taken[n] = e
        _note(carried, R_nb, E, offered[e, 0], theta, states[n])
        if not held and add_to_estimate(W, r, theta, known, summed, prior, counted):
            form[0] = BY_INFORMATION
        progress[0], progress[1], progress[2] = k + 1, at + r, n + 1
    return 0
