"""Times and the values that belong to them, taken one by one or many at once."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array


class Rows:
    """A growing table: increasing times and rows of one width.

    Single ones wait in lists, which is cheaper to add to than an array; whoever asks for arrays
    finds them put together.

    Attributes:
        last: the newest time, s; -inf if there is none.
    """

    __slots__ = ("_parts", "_t", "_x", "last")

    def __init__(self) -> None:
        self._parts: list[tuple[Array, Array]] = []
        self._t: list[float] = []
        self._x: list[tuple[float, ...]] = []
        self.last = -np.inf

    def __len__(self) -> int:
        return sum(len(t) for t, _ in self._parts) + len(self._t)

    @property
    def first(self) -> float:
        """The oldest time, s; inf if there is none."""
        if self._parts:
            return self._parts[0][0].item(0)
        return self._t[0] if self._t else np.inf

    def add(self, t: float, row: tuple[float, ...]) -> None:
        """Put a row behind the others; its time is later than theirs."""
        self._t.append(t)
        self._x.append(row)
        self.last = t

    def extend(self, t: Array, rows: Array) -> None:
        """Put rows (n, d), n >= 1, behind the others; ``t`` (n,) increases and is later."""
        self._close()
        self._parts.append((t, rows))
        self.last = t.item(-1)

    def arrays(self) -> tuple[Array, Array]:
        """Times (n,) and rows (n, d), which must not be written to; (0,) both if there is none."""
        self._close()
        if not self._parts:
            return np.zeros(0), np.zeros(0)
        if len(self._parts) > 1:
            times, rows = zip(*self._parts, strict=True)
            self._parts = [(np.concatenate(times), np.concatenate(rows))]
        return self._parts[0]

    def drop(self, n: int) -> None:
        """Forget the first ``n`` rows."""
        t, rows = self.arrays()
        # A copy: of what is left a few seconds, a view of it would hold all that is gone.
        self._parts = [(t[n:].copy(), rows[n:].copy())] if n < len(t) else []
        if not self._parts:
            self.last = -np.inf

    def _close(self) -> None:
        """What came one by one becomes arrays."""
        if self._t:
            self._parts.append((np.array(self._t), np.array(self._x)))
            self._t, self._x = [], []
