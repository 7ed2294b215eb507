"""Arrays as the core writes them: float64, SI units, frames in their names."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Float64 array; its shape stands in the docstring of whoever takes or gives it."""
Mask: TypeAlias = NDArray[np.bool_]
"""Boolean array."""
Vector3: TypeAlias = tuple[float, float, float]
"""Three numbers of one place or direction, in a record that never changes."""
Vector2: TypeAlias = tuple[float, float]
"""Two numbers of one kind, in such a record."""
Vector4: TypeAlias = tuple[float, float, float, float]
"""Four numbers of one kind, in such a record."""


def vector2(values: Iterable[float]) -> Vector2:
    """Two numbers for a record.

    Raises:
        ValueError: there are more or fewer.
    """
    a, b = values
    return (float(a), float(b))


def vector3(values: Iterable[float]) -> Vector3:
    """Three numbers for a record.

    Raises:
        ValueError: there are more or fewer.
    """
    x, y, z = values
    return (float(x), float(y), float(z))


def vector4(values: Iterable[float]) -> Vector4:
    """Four numbers for a record.

    Raises:
        ValueError: there are more or fewer.
    """
    a, b, c, d = values
    return (float(a), float(b), float(c), float(d))
