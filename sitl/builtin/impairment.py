"""What a bad link does to frames: loses, delays and doubles them, reproducibly."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(slots=True)
class Impairment:
    """Probabilities of loss and duplication, delay and its random extra (wall-clock s).

    Frames that are delayed by different amounts overtake each other, as datagrams do.
    """

    loss: float = 0.0
    duplication: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    seed: int = 0
    _rng: np.random.Generator = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng([self.seed, 51])

    @property
    def harmless(self) -> bool:
        """Whether every frame passes as it is."""
        return not (self.loss or self.duplication or self.delay or self.jitter)

    def fates(self) -> tuple[float, ...]:
        """Delay of each copy of the next frame that arrives; empty when it is lost."""
        if self._rng.random() < self.loss:
            return ()
        copies = 2 if self._rng.random() < self.duplication else 1
        return tuple(self.delay + self.jitter * float(self._rng.random()) for _ in range(copies))
