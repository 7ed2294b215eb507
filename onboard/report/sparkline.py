"""A number over flights as a small picture in a line: inline SVG, colours from the style sheet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

Array = NDArray[np.float64]

WIDTH, HEIGHT, EDGE = 120.0, 30.0, 4.0
MOST_POINTS = 48
"""Of a picture: the latest flights, as wide as they are to be told apart on a telephone."""


def sparkline(
    value: Array, sigma: Array, parts: Sequence[int], odd: Sequence[int], label: str
) -> Markup:
    """Flights in order, evenly spaced: a dot and a bar of two sigma each, a line for each part.

    Args:
        value: (n,) of the flights.
        sigma: (n,) of them.
        parts: (n,) counts up at each step, where the line is broken.
        odd: flights that contradict the others.
        label: what it shows, for those who do not see it.
    """
    n = len(value)
    first = max(0, n - MOST_POINTS)
    value, sigma, parts = value[first:], sigma[first:], list(parts[first:])
    odd = [k - first for k in odd if k >= first]
    x = _across(len(value))
    low, high = float(np.min(value - 2 * sigma)), float(np.max(value + 2 * sigma))
    scale = (HEIGHT - 2 * EDGE) / (high - low)

    def y(v: Array) -> Array:
        return HEIGHT - EDGE - (v - low) * scale

    bars = "".join(
        f"M{a:.1f} {b:.1f}V{c:.1f}"
        for a, b, c in zip(x, y(value - 2 * sigma), y(value + 2 * sigma), strict=True)
    )
    usual = [k for k in range(len(value)) if k not in odd]
    lines = "".join(
        _line([(x[k], float(y(value[k : k + 1])[0])) for k in usual if parts[k] == part])
        for part in dict.fromkeys(parts)
    )
    steps = "".join(
        f"M{(x[k] + x[k + 1]) / 2:.1f} 0V{HEIGHT:.0f}"
        for k in range(len(value) - 1)
        if parts[k] != parts[k + 1]
    )
    heights = y(value)
    dots = {
        kind: "".join(f"M{x[k]:.1f} {heights[k]:.1f}h0" for k in which)
        for kind, which in (("spark-dot", usual), ("spark-odd", odd))
    }
    paths = {"spark-bar": bars, "spark-step": steps, "spark-line": lines, **dots}
    drawn = "".join(f'<path class="{kind}" d="{d}"/>' for kind, d in paths.items() if d)
    return Markup(  # noqa: S704 - the label is escaped
        f'<svg class="spark" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}" role="img" '
        f'preserveAspectRatio="none" aria-label="{escape(label)}">{drawn}</svg>'
    )


def _across(n: int) -> Array:
    out: Array = np.linspace(EDGE, WIDTH - EDGE, n) if n > 1 else np.array([WIDTH / 2])
    return out


def _line(points: Sequence[tuple[float, float]]) -> str:
    if len(points) < 2:
        return ""
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
