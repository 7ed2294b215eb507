"""What scale and offset of a simulated accelerometer truly are, as the tool's numbers mean it.

* an effect on the accelerometer that the model has is counted from where the tool counts it: a
  drift from 35 degC, a ramp from the first sample, what throttle, vibration or load make from
  none of it; of a jump the six are those before it, and those after it are asked as well;
* one that the model has not got is in the six, and in whatever the model has in its place: true
  are those that come nearest to how the force was read, over the samples of this flight; but an
  effect that is an offset by nature is none of the scale, even if it comes and goes with the force;
* of an accelerometer of which nothing is said, they are its own;
* effects of attitude and receiver change no number.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from onboard.core.diagnosis.evidence import Judge
from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import NodeMaker
from onboard.core.physics.effect import Effect
from sitl.builtin import effects as fx
from sitl.builtin.effects.accelerometer_hysteresis import AccelerometerHysteresis
from sitl.builtin.smoothing import DT
from sitl.recording import Flight

IN_PROPORTION: Final = (
    AccelerometerHysteresis,
    fx.AccelerometerTilt,
    fx.CrossAxis,
    fx.LoadFlex,
    fx.ScaleNonlinearity,
    fx.ScaleStep,
)
"""Effects that make of a force what it is; all others make an offset [physics]."""


@dataclass(frozen=True, slots=True)
class Felt:
    """An effect over a flight: times (n,), s, the true force and what it adds (n, 3), m/s^2."""

    t: Array
    f_b: Array
    extra: Array
    in_proportion: bool


def true_six(judge: Judge, flight: Flight, imu: int, modelled: Collection[str]) -> Array:
    """(6,) what scale and offset of accelerometer ``imu`` should be in the judge's model.

    Args:
        judge: whose model it is, of a flight with a board that lies as the vehicle does.
        flight: what was flown.
        imu: which accelerometer.
        modelled: effects that the model has, by name.
    """
    sensor, spec = flight.spec.imus[imu - 1], flight.spec
    scale, offset = np.array(sensor.scale), np.array(sensor.offset)
    mine = [e for e in spec.effects if getattr(e, "imu", 0) in (0, imu)]
    for ramp in (e for e in mine if isinstance(e, fx.BiasRamp) and e.name in modelled):
        offset = offset + ramp.sizes * judge.final.origin.t0 / scale
    left = [e for e in mine if e.name not in modelled and not judge.evidence.clipped]
    there = {e.name for e in mine}
    others = [f for f in judge.final.families if f.is_read and f.effect not in there]
    by, more = np.zeros(3), np.zeros(3)
    for effect in left:
        gain, bias = _as_six(_felt(flight, imu - 1, effect), *_columns(judge, others))
        by, more = by + gain, more + bias
    # What is read is (f + by f + more) / scale + offset.
    return np.concatenate([scale / (1.0 + by), offset + more / scale])


def _as_six(felt: Felt, at: Array, columns: Array) -> tuple[Array, Array]:
    """What an effect is on top of a scale (3,) and of an offset (3,), m/s^2.

    Args:
        felt: the effect.
        at: (n,) s, samples that were fitted.
        columns: (n, 3, k) of what else may stand for it.
    """
    f_b, extra = (
        np.column_stack([np.interp(at, felt.t, x) for x in a.T]) for a in (felt.f_b, felt.extra)
    )
    eye = np.tile(np.eye(3), (len(at), 1, 1))
    # An offset is none of the scale, even if it comes and goes with the force in this flight.
    gain = f_b[:, :, None] * eye * felt.in_proportion
    A = np.concatenate([gain, eye, -columns], axis=2).reshape(3 * len(at), -1)
    # What is false may stand for nothing as well: the least of it.
    found = np.linalg.lstsq(A, extra.reshape(-1), rcond=None)[0]
    return found[:3], found[3:6]


def _columns(judge: Judge, families: Sequence[Effect]) -> tuple[Array, Array]:
    """Times (n,) of the samples that were fitted, and regressors (n, 3, k) of families."""
    model, before = judge.engine.model, None
    six = judge.final.solution.theta[:6]
    times, columns = [], []
    for batch in judge.engine.batches:
        before = model.remembering(batch.segment, {} if before is None else before.slow)
        nodes = NodeMaker(before, np.zeros(3), six).signals(before.t[None])
        read = [f.acceleration(nodes) for f in families if f.available(nodes)]
        own = [a[0] for a in read if a is not None]
        times.append(before.t)
        columns.append(np.concatenate([np.zeros((len(before.t), 3, 0)), *own], axis=2))
    return np.concatenate(times), np.concatenate(columns)


def _felt(flight: Flight, index: int, effect: fx.Effect) -> Felt:
    """One effect over a flight."""
    times, forces, extras = [], [], []
    for piece in flight.pieces:
        if piece.flight is None:
            continue
        imu, n = piece.imus[index], piece.trajectory.n
        t: Array = piece.start + DT * np.arange(n, dtype=np.float64)
        scene = fx.Scene(
            f_b=piece.trajectory.f_b,
            elapsed=t,
            temperature=imu.temperature,
            level=imu.vibration,
            trajectory=piece.trajectory,
        )
        extra = effect.reads_too_much(scene)
        times.append(t)
        forces.append(scene.f_b)
        extras.append(np.zeros((n, 3)) if extra is None else extra)
    in_proportion = isinstance(effect, IN_PROPORTION)
    return Felt(np.concatenate(times), np.vstack(forces), np.vstack(extras), in_proportion)
