"""One simulated motion of a rigid board, felt by accelerometers of known scale and offset."""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.segments import Batch, Fixes, Segment
from onboard.core.maths.accelerometer import SixParameters

RATE = 50.0


class Motion:
    """Slow random force and rotation about every axis, of ``seconds``."""

    def __init__(self, rng: np.random.Generator, seconds: float = 200.0, turning: float = 1.0):
        self.t = np.arange(0.0, seconds, 1.0 / RATE)
        f = rng.uniform(0.05, 0.4, (4, 3))
        phase = rng.uniform(0.0, 2.0 * np.pi, (4, 3))
        w = 2.0 * np.pi * f
        angle = self.t[:, None, None] * w + phase
        self.force = np.array([0.0, 0.0, -9.8]) + 1.5 * np.sin(angle).sum(axis=1)
        angle = self.t[:, None, None] * w[::-1] + phase
        self.w = 0.5 * turning * np.sin(angle).sum(axis=1)
        self.dw = 0.5 * turning * (w[::-1] * np.cos(angle)).sum(axis=1)

    def at(self, place: np.ndarray) -> np.ndarray:
        """(n, 3) specific force at a place of the board, m/s^2."""
        swing = np.cross(self.w, np.cross(self.w, place)) + np.cross(self.dw, place)
        return self.force + swing


def batches(
    motion: Motion,
    six: SixParameters,
    place: np.ndarray,
    noise: np.ndarray,
    configured: np.ndarray | None = None,
) -> list[Batch]:
    """What an accelerometer at ``place`` records, configured to be at ``configured`` (there)."""
    raw = six.undo(motion.at(place)) + noise
    lever = -(place if configured is None else configured)
    out = []
    for start in np.arange(1.0, motion.t[-1] - 11.0, 10.0):
        cut = (motion.t >= start - 0.8) & (motion.t <= start + 10.8)
        t = motion.t[cut]
        epochs = np.linspace(start, start + 10.0, 51)
        n = len(epochs)
        out.append(
            Batch(
                Segment(
                    t,
                    motion.w[cut],
                    raw[cut],
                    t[[0, -1]],
                    np.stack([np.eye(3)] * 2),
                    np.eye(3),
                    lever_arm_b=lever,
                ),
                Fixes(epochs, np.zeros((n, 3)), np.zeros(n), np.zeros(n)),
                np.ones(n, dtype=bool),
                fresh=not out,
            )
        )
    return out


def wandering(rng: np.random.Generator, n: int, sigma: float, seconds: float) -> np.ndarray:
    """(n, 3) first-order Gauss-Markov noise."""
    keep = np.exp(-1.0 / (RATE * seconds))
    steps = sigma * np.sqrt(1.0 - keep**2) * rng.standard_normal((n, 3))
    out = np.empty((n, 3))
    x = sigma * rng.standard_normal(3)
    for i in range(n):
        x = keep * x + steps[i]
        out[i] = x
    return out
