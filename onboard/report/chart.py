"""Small SVG charts, drawn as text: they scale with the page and follow its light or dark look."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WIDTH, HEIGHT = 720.0, 220.0
LEFT, RIGHT, TOP, BOTTOM = 52.0, 10.0, 12.0, 28.0
MOST_POINTS = 1200


def decimated(t: Array, y: Array, most: int = MOST_POINTS) -> tuple[Array, Array]:
    """At most ``most`` points: of each bin its largest magnitude, so that no peak is lost."""
    good = np.isfinite(t) & np.isfinite(y)
    t, y = t[good], y[good]
    if len(t) <= most:
        return t, y
    edges = np.linspace(0, len(t), most + 1).astype(int)
    pick = np.array([a + int(np.argmax(np.abs(y[a:b]))) for a, b in pairwise(edges.tolist())])
    return t[pick], y[pick]


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round numbers inside a range."""
    if not high > low:
        return [low]
    raw = (high - low) / count
    power = 10.0 ** np.floor(np.log10(raw))
    step = float(next((m * power for m in (1, 2, 5, 10) if m * power >= raw), 10 * power))
    first = np.ceil(low / step) * step
    return [float(x) for x in np.arange(first, high + step * 1e-6, step)]


def series_chart(
    title: str,
    unit: str,
    lines: Sequence[tuple[str, str, Array, Array]],
    shaded: Sequence[tuple[float, float]] = (),
) -> str:
    """Lines over time.

    Args:
        title: spoken description.
        unit: of the vertical axis.
        lines: (name, CSS class, t, y) each.
        shaded: intervals of t to shade.
    """
    thinned = ((name, css, decimated(t, y)) for name, css, t, y in lines)
    drawn = [(name, css, t, y) for name, css, (t, y) in thinned if len(t) > 1]
    if not drawn:
        return "<p>nothing to draw</p>"
    t0 = min(float(d[2].min()) for d in drawn)
    t1 = max(float(d[2].max()) for d in drawn)
    top = max(float(np.max(np.abs(d[3]))) for d in drawn) or 1.0
    low = -top if any(float(d[3].min()) < 0 for d in drawn) else 0.0

    def x(t: float) -> float:
        return LEFT + (t - t0) / max(t1 - t0, 1e-9) * (WIDTH - LEFT - RIGHT)

    def y(v: float) -> float:
        return TOP + (top - v) / max(top - low, 1e-9) * (HEIGHT - TOP - BOTTOM)

    parts = [
        f'<svg viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}" role="img" aria-label="{escape(title)}">'
    ]
    for a, b in shaded:
        left, right = x(max(a, t0)), x(min(b, t1))
        if right > left:
            parts.append(
                f'<rect class="shade" x="{left:.1f}" y="{TOP}" width="{right - left:.1f}" '
                f'height="{HEIGHT - TOP - BOTTOM:.1f}"/>'
            )
    parts.extend(
        f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(v):.1f}" y2="{y(v):.1f}"/>'
        f'<text class="tick" x="{LEFT - 6}" y="{y(v) + 4:.1f}" text-anchor="end">{v:g}</text>'
        for v in ticks(low, top, 4)
    )
    parts.extend(
        f'<text class="tick" x="{x(t):.1f}" y="{HEIGHT - 8}" text-anchor="middle">{t:g}</text>'
        for t in ticks(t0, t1, 8)
    )
    parts.append(f'<text class="tick" x="4" y="{TOP + 4}">{escape(unit)}</text>')
    for _, css, t, v in drawn:
        points = " ".join(f"{x(a):.1f},{y(b):.1f}" for a, b in zip(t, v, strict=True))
        parts.append(f'<polyline class="line {css}" points="{points}"/>')
    parts.append("</svg>")
    legend = " ".join(f'<span class="key {css}">{escape(name)}</span>' for name, css, _, _ in drawn)
    caption = f"<figcaption>{legend} seconds since the start</figcaption>"
    return f"<figure>{''.join(parts)}{caption}</figure>"


def bar_pairs(rows: Sequence[tuple[str, float, float]]) -> str:
    """Horizontal bars, before above after, one pair a row."""
    most = max((v for _, a, b in rows for v in (a, b) if np.isfinite(v)), default=1.0) or 1.0
    out = []
    for name, before, after in rows:
        bars = "".join(
            f'<div class="bar {css}" style="width:{100 * min(v / most, 1.0):.1f}%"></div>'
            f'<span class="value">{v:.2f}</span>'
            for css, v in (("before", before), ("after", after))
            if np.isfinite(v)
        )
        out.append(
            f'<div class="pair"><div class="name">{escape(name)}</div><div>{bars}</div></div>'
        )
    return f'<div class="bars">{"".join(out)}</div>'
