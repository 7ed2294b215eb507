"""Maximum of a quadratic between bounds, as a loop that numba compiles."""

from __future__ import annotations

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled


@compiled("void(f8[:,::1], f8[::1], f8[::1], f8[::1], i8, f8, f8[::1])")
def bounded(
    H: Array, slope: Array, low: Array, high: Array, sweeps: int, close: float, x: Array
) -> None:
    """:func:`onboard.core.filter.noise_step.bounded`, from where ``x`` (n,) is on.

    Args:
        H: (n, n) see there.
        slope: (n,) see there.
        low: (n,) see there.
        high: (n,) see there.
        sweeps: most turns along all coordinates.
        close: change of a coordinate in one turn below which it is found.
        x: (n,) written to.
    """
    n = len(x)
    for _ in range(sweeps):
        most = 0.0
        for i in range(n):
            rest = slope[i]
            for j in range(n):
                rest -= H[i, j] * x[j]
            moved = min(max(x[i] + rest / H[i, i], low[i]), high[i])
            most = max(most, abs(moved - x[i]))
            x[i] = moved
        if most < close:
            break
