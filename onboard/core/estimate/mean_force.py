"""What an accelerometer reads in the mean of a flight: scale, offset, and all beside them.

Where vibration shifts an offset, or a blow has moved it, the six numbers are not all that a flight
says of an accelerometer.  Another one on the same board has not got that, and is to be compared
with all of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.limits import OFFSET_FLOOR, SCALE_FLOOR
from onboard.core.estimate.merged_record import with_six
from onboard.core.estimate.result import Calibration
from onboard.core.inputs.segments import Batch, Segment
from onboard.core.maths.accelerometer import linear_of, parameters_jacobian
from onboard.core.maths.arrays import Array, Mask
from onboard.core.model.quadrature import NodeMaker
from onboard.core.model.regressors import Model

SIX = "six"
LEAST_LOAD = 0.01
"""A force that changes by less over a flight, m/s^2, has nothing to be wrong by [physics]."""
Chosen = Callable[[Batch, Array], Mask]
"""Which of some times (n,), s, of a batch count."""


def mean_columns(engine: Engine, chosen: Chosen | None = None) -> Array | None:
    """What each unknown of an engine's model adds to the mean force, (3, m), sensor axes.

    Args:
        engine: has its flight.
        chosen: of the samples between fixes; None: all.

    Returns:
        m/s^2 per unit; None if there are no samples.
    """
    columns, count = np.zeros((3, engine.model.size)), 0
    for batch, segment, mine in _flown(engine):
        t = segment.t[mine]
        if chosen is not None:
            t = t[chosen(batch, t)]
        if len(t):
            columns += _added(engine, segment, t).sum(axis=0)
            count += len(t)
    return columns / count if count else None


def mean_force_sigma(engine: Engine) -> Array | None:
    """(3,) of the mean force of a flight, with all undone that is read wrong, body axes, m/s^2.

    The six and what is beside them are known together better than each: where two effects do as
    well, with another offset each, the mean that they leave is one and the same.  So it has what
    the sums leave open and what no model knows, and not what the choice of the model does.

    Args:
        engine: has its flight and its sums; None if it has neither.
    """
    model, solution, columns = engine.model, engine.solution(), mean_columns(engine)
    if solution is None or columns is None:
        return None
    columns[:, ~_read(model)] = 0.0
    six, R_bs = solution.theta[model.slices[SIX]], engine.batches[0].segment.R_bs
    raw = np.diag(columns[:, model.slices[SIX]])
    floor = (SCALE_FLOOR * raw) ** 2 + (OFFSET_FLOOR * six[:3]) ** 2
    C = columns @ solution.covariance @ columns.T + np.diag(floor)
    out: Array = np.sqrt(np.diag(R_bs @ C @ R_bs.T))
    return out


def load_sigma(engine: Engine) -> Array | None:
    """(3,) of a force by the load, body axes, 1: what its change over a flight leaves unknown.

    A flight that holds its load tells scale and offset together and not apart: the mean force is
    known, and by how much it is more in a climb than in a descent is not.

    Args:
        engine: has its flight and its sums; None if it has neither.
    """
    model, solution = engine.model, engine.solution()
    if solution is None:
        return None
    added, felt = [], []
    for _, segment, mine in _flown(engine):
        if not mine.any():
            continue
        # Loads change over seconds, and what shakes is not asked for.
        t = segment.t[mine]
        first = np.flatnonzero(np.diff(np.floor(t), prepend=-np.inf))
        counts = np.diff(np.append(first, len(t)))[:, None]
        made = np.add.reduceat(_added(engine, segment, t), first) / counts[:, None]
        loads = np.add.reduceat(segment.raw_s[mine], first) / counts
        added.append(segment.R_bs @ made)
        felt.append(loads @ segment.R_bs.T)
    if not added:
        return None
    A, felt_b = np.concatenate(added), np.concatenate(felt)
    A, felt_b = A - A.mean(axis=0), felt_b - felt_b.mean(axis=0)
    A[..., ~_read(model)] = 0.0
    variance = np.mean(
        np.einsum("nij,jk,nik->ni", A, solution.covariance, A, optimize=True), axis=0
    )
    out: Array = np.sqrt(variance / np.maximum(np.mean(felt_b**2, axis=0), LEAST_LOAD**2))
    return out


def in_the_mean(made: Calibration, engine: Engine) -> Calibration:
    """The record with the offset that the accelerometer has in the mean of the flight.

    Args:
        made: of ``engine``'s sums.
        engine: nothing changes if its model has no physics besides the calibration's own.
    """
    model, solution = engine.model, engine.solution()
    always = {f.name for f in calibration_model(engine.point).families}
    found = [f.name for f in model.families if f.name not in always]
    columns = mean_columns(engine) if found else None
    if columns is None or solution is None:
        return made
    of_found = np.zeros(model.size, dtype=bool)
    for name in found:
        of_found[model.slices[name]] = True
    columns[:, ~of_found] = 0.0
    linear = linear_of(np.array(made.scale + made.offset))
    T = np.zeros((6, model.size))
    T[:, model.slices[SIX]] = np.eye(6)
    plain = T @ solution.covariance @ T.T
    T[3:] += columns
    linear[3:] += columns @ model.whole(solution.theta)
    covariance = T @ solution.covariance @ T.T
    # What its sigmas have beyond the sums (floors, axes, what is open) stays as it is.
    J = parameters_jacobian(solution.theta)
    return with_six(made, linear, covariance, np.array(made.covariance) - J @ plain @ J.T)


def _flown(engine: Engine) -> Iterator[tuple[Batch, Segment, Mask]]:
    """Batches, their samples with what effects remember, and which of them are between fixes."""
    before: Segment | None = None
    for batch in engine.batches:
        known = {} if batch.fresh or before is None else before.slow
        segment = before = engine.model.remembering(batch.segment, known)
        yield batch, segment, (segment.t >= batch.fixes.t[0]) & (segment.t < batch.fixes.t[-1])


def _read(model: Model) -> Mask:
    """(m,) which unknowns are of what the accelerometer reads."""
    out: Mask = np.zeros(model.size, dtype=np.bool_)
    for family in model.families:
        out[model.slices[family.name]] = family.is_read
    return out


def _added(engine: Engine, segment: Segment, t: Array) -> Array:
    """(n, 3, m) what each unknown adds to the force at times ``t`` (n,), sensor axes."""
    nodes = NodeMaker(segment, np.zeros(3), engine.point.six).signals(t[None])
    out = np.zeros((len(t), 3, engine.model.size))
    for family in engine.model.families:
        pushed = family.acceleration(nodes) if family.available(nodes) else None
        if pushed is not None:
            out[:, :, engine.model.slices[family.name]] = segment.R_bs.T @ pushed[0]
    return out
