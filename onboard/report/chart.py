"""Small charts as inline SVG.

The drawing segments with the page and its labels are page text, so that a phone shows the same
chart with letters of the same size.  Colours come from the page's style sheet by class.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

Array = NDArray[np.float64]

WIDTH, HEIGHT = 1000.0, 300.0
MOST_POINTS = 1400
TIME_STEPS = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 1800.0, 3600.0)
"""Between two marks of a time axis, s."""
LONGEST_STEP_S = 1.0
"""A pause in the data longer than this, and than four usual steps, is drawn as a gap."""


@dataclass(frozen=True, slots=True)
class Line:
    """One curve: ``x``, ``y`` (n,), CSS class and words for the legend."""

    x: Array
    y: Array
    kind: str
    label: str


@dataclass(frozen=True, slots=True)
class Points:
    """Single measurements: ``x``, ``y`` (n,), CSS class and words for the legend.

    ``spread`` (n,), if there is one, is drawn as a bar up and down from each.
    """

    x: Array
    y: Array
    kind: str
    label: str
    spread: Array | None = None


@dataclass(frozen=True, slots=True)
class Ribbon:
    """A filled area between two curves: ``x``, ``low``, ``high`` (n,), all finite."""

    x: Array
    low: Array
    high: Array
    kind: str


@dataclass(frozen=True, slots=True)
class Band:
    """A shaded interval of the horizontal axis."""

    start: float
    end: float
    kind: str


def decimate(x: Array, y: Array, most: int = MOST_POINTS) -> tuple[Array, Array]:
    """At most ``most`` finite points of a curve, extremes kept.

    The axis is cut into bins; each leaves its lowest and its highest point, in order of ``x``.
    """
    finite = np.isfinite(x) & np.isfinite(y)
    x, y = x[finite], y[finite]
    if len(x) <= most:
        return x, y
    edges = np.linspace(0, len(x), most // 2 + 1).astype(np.intp)
    keep: list[int] = []
    for a, b in itertools.pairwise(edges):
        low, high = a + int(np.argmin(y[a:b])), a + int(np.argmax(y[a:b]))
        keep += sorted({low, high})
    return x[keep], y[keep]


def ticks(low: float, high: float, most: int = 5) -> list[float]:
    """Round numbers within ``low`` ... ``high``: steps of 1, 2, 5 times a power of ten."""
    span = high - low
    if not (math.isfinite(span) and span > 0.0):
        return []
    raw = span / most
    power = 10.0 ** math.floor(math.log10(raw))
    steps = [k * power for k in (0.5, 1.0, 2.0, 5.0, 10.0)]
    rough = next(i for i, step in enumerate(steps) if step >= raw * (1.0 - 1e-9))
    found: list[float] = []
    # One number is no scale: then rather more of them than asked for.
    for step in steps[rough : max(rough - 2, -1) : -1]:
        first = math.ceil(low / step - 1e-9)
        last = math.floor(high / step + 1e-9)
        found = [k * step for k in range(first, last + 1)]
        if len(found) > 2:
            break
    return found


def time_ticks(low: float, high: float, most: int = 6) -> tuple[list[float], float, str]:
    """Marks of a time axis (s) that people count in, and the unit that makes them short numbers.

    Returns:
        Times (s), seconds of the unit, its name.
    """
    span = high - low
    if not (math.isfinite(span) and span > 0.0):
        return [], 1.0, "s"
    step = next((s for s in TIME_STEPS if span / s <= most), None)
    marks = (
        ticks(low, high, most)
        if step is None
        else [k * step for k in range(math.ceil(low / step - 1e-9), math.floor(high / step) + 1)]
    )
    for unit, name in ((3600.0, "h"), (60.0, "min")):
        if marks and marks[-1] >= unit and all(mark % unit == 0.0 for mark in marks):
            return marks, unit, name
    return marks, 1.0, "s"


def line_chart(
    title: str,
    unit: str,
    lines: Sequence[Line],
    bands: Sequence[Band] = (),
    *,
    ribbons: Sequence[Ribbon] = (),
    points: Sequence[Points] = (),
    x_label: str = "time",
    x_unit: str = "s",
    x_range: tuple[float, float] | None = None,
    y_range: tuple[float, float] | None = None,
    symmetric: bool = True,
    summary: str = "",
) -> Markup:
    """Curves over a common axis; a sentence instead if there is not one finite point.

    The vertical range covers 99.5 % of all points, so that a single wild value does not flatten the
    rest; what is beyond is cut at the edge.  ``x_range`` and ``y_range`` set the ranges instead.
    Under the horizontal axis stand what it is and its unit; seconds become minutes or hours.
    ``summary`` tells those who do not see the curves what they show.
    """
    drawn = [(*decimate(line.x, line.y), line) for line in lines]
    xs = np.concatenate([np.zeros(0), *(x for x, _, _ in drawn), *(p.x for p in points)])
    ys = np.concatenate([np.zeros(0), *(y for _, y, _ in drawn), *(p.y for p in points)])
    xs, ys = xs[np.isfinite(xs)], ys[np.isfinite(ys)]
    if len(xs) == 0 or len(ys) == 0:
        return Markup('<p class="muted">{}: no data to draw.</p>').format(title)
    x0, x1 = x_range or (float(xs.min()), float(xs.max()))
    sheet = _Sheet(x0, x1 if x1 > x0 else x0 + 1.0, *(y_range or _range(ys, symmetric=symmetric)))
    shapes = [sheet.band(band) for band in bands]
    x_marks, x_labels, x_unit, size = sheet.time_axis(x_unit)
    y_marks, y_labels = sheet.value_axis()
    shapes += [*x_marks, *y_marks]
    shapes += [sheet.ribbon(ribbon) for ribbon in ribbons]
    shapes += [sheet.dots(p) for p in points]
    shapes += [sheet.curve(x, y, line.kind, line.label) for x, y, line in drawn]
    return Markup(
        "<figure><figcaption>{}{}</figcaption>"
        '<div class="plot"{}><svg viewBox="0 0 {:.0f} {:.0f}" preserveAspectRatio="none" '
        'role="img" aria-label="{}">{}</svg>{}<span class="along">{}</span></div></figure>'
    ).format(
        title,
        Markup(' <span class="muted">({})</span>').format(unit) if unit else "",
        sheet.ranges(x_unit, size),
        WIDTH,
        HEIGHT,
        f"{title}: {summary}" if summary else title,
        Markup("".join(shapes)),  # noqa: S704  numbers and escaped classes only
        Markup("".join(x_labels + y_labels)),  # noqa: S704
        f"{x_label}, {x_unit}" if x_unit else x_label,
    )


@dataclass(frozen=True, slots=True)
class _Sheet:
    """The ranges of a chart, and how what lies in them is drawn, as SVG."""

    x0: float
    x1: float
    y0: float
    y1: float

    def px(self, x: float) -> float:
        return WIDTH * (x - self.x0) / (self.x1 - self.x0)

    def py(self, y: float) -> float:
        return HEIGHT * (self.y1 - min(max(y, self.y0), self.y1)) / (self.y1 - self.y0)

    def ranges(self, unit: str, size: float) -> Markup:
        """What the page's script needs to read values off: both ranges, the horizontal unit."""
        told = Markup(
            ' data-x="{:.9g} {:.9g}" data-y="{:.9g} {:.9g}" data-unit="{}" data-size="{:g}"'
        )
        return told.format(self.x0, self.x1, self.y0, self.y1, unit, size)

    def time_axis(self, unit: str) -> tuple[list[str], list[str], str, float]:
        """Marks, their labels and their unit, which becomes minutes or hours if it is seconds.

        Last is the size of that unit in the units of the data.
        """
        marks, unit_s = ticks(self.x0, self.x1), 1.0
        if unit == "s":
            marks, unit_s, unit = time_ticks(self.x0, self.x1)
        grid = [f'<path class="grid upright" d="M{self.px(v):.1f} 0V{HEIGHT:.0f}"/>' for v in marks]
        labels = [_label("x", "left", self.px(v) / WIDTH, v / unit_s) for v in marks]
        return grid, labels, unit, unit_s

    def value_axis(self) -> tuple[list[str], list[str]]:
        """Marks and their labels; the one at zero stands out."""
        marks = ticks(self.y0, self.y1, 4)
        grid = [
            f'<path class="{"zero" if v == 0 else "grid"}" d="M0 {self.py(v):.1f}H{WIDTH:.0f}"/>'
            for v in marks
        ]
        return grid, [_label("y", "top", self.py(v) / HEIGHT, v) for v in marks]

    def band(self, band: Band) -> str:
        a, b = self.px(max(band.start, self.x0)), self.px(min(band.end, self.x1))
        if not (math.isfinite(a) and math.isfinite(b)) or b < a:
            return ""
        return (
            f'<rect class="band {escape(band.kind)}" x="{a:.1f}" y="0" '
            f'width="{max(b - a, 2.0):.1f}" height="{HEIGHT:.0f}"/>'
        )

    def ribbon(self, ribbon: Ribbon) -> str:
        there = self._corners(ribbon.x, ribbon.high)
        back = self._corners(ribbon.x, ribbon.low)
        starts = [*np.flatnonzero(_begins(ribbon.x)).tolist(), len(there)]
        outline = "".join(
            f"M{'L'.join(there[a:b] + back[a:b][::-1])}Z" for a, b in itertools.pairwise(starts)
        )
        return f'<path class="ribbon {escape(ribbon.kind)}" d="{outline}"/>' if outline else ""

    def _corners(self, x: Array, y: Array) -> list[str]:
        return [
            f"{self.px(float(a)):.1f} {self.py(float(b)):.1f}" for a, b in zip(x, y, strict=True)
        ]

    def dots(self, points: Points) -> str:
        """Strokes without length: round, and of one size however the drawing is stretched."""
        kind = escape(points.kind)
        seen = np.isfinite(points.x) & np.isfinite(points.y)
        seen &= (points.x >= self.x0) & (points.x <= self.x1)
        there = self._corners(points.x[seen], points.y[seen])
        out = f'<path class="dots {kind}" d="{"".join(f"M{c}h0" for c in there)}"/>'
        if points.spread is None:
            return out
        wide = np.nan_to_num(points.spread[seen])
        low = self._corners(points.x[seen], points.y[seen] - wide)
        high = self._corners(points.x[seen], points.y[seen] + wide)
        bars = "".join(f"M{a}L{b}" for a, b in zip(low, high, strict=True))
        return f'<path class="spread {kind}" d="{bars}"/>{out}'

    def curve(self, x: Array, y: Array, kind: str, label: str) -> str:
        d = _path([self.px(float(v)) for v in x], [self.py(float(v)) for v in y], x)
        return f'<path class="line {escape(kind)}" d="{d}" data-label="{escape(label)}"/>'


def pair_bar(before: float, after: float, longest: float, title: str) -> Markup:
    """Two horizontal bars, before above after, in units of ``longest``; nothing for NaN."""

    def bar(value: float, y: int, kind: str) -> str:
        if not (math.isfinite(value) and math.isfinite(longest) and longest > 0.0):
            return ""
        width = 100.0 * min(max(value / longest, 0.0), 1.0)
        return f'<rect class="bar {kind}" x="0" y="{y}" width="{width:.2f}" height="7"/>'

    return Markup(
        '<svg class="bars" viewBox="0 0 100 17" preserveAspectRatio="none" role="img" '
        'aria-label="{}">{}</svg>'
    ).format(title, Markup(bar(before, 1, "before") + bar(after, 9, "after")))  # noqa: S704


def share_bar(share: float, title: str, *, enough: bool) -> Markup:
    """One horizontal bar, 0 ... 1 of its width."""
    width = 100.0 * min(max(share, 0.0), 1.0) if math.isfinite(share) else 0.0
    return Markup(
        '<svg class="bars" viewBox="0 0 100 8" preserveAspectRatio="none" role="img" '
        'aria-label="{}"><rect class="bar {}" x="0" y="0" width="{:.2f}" height="8"/></svg>'
    ).format(title, "good" if enough else "low", width)


def _range(ys: Array, *, symmetric: bool) -> tuple[float, float]:
    if symmetric:
        most = float(np.percentile(np.abs(ys), 99.5)) * 1.1
        most = most if most > 0.0 else 1.0
        return -most, most
    low, high = (float(v) for v in np.percentile(ys, [0.0, 99.5]))
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _label(axis: str, side: str, share: float, value: float) -> str:
    text = f"{value:.6g}".replace("-", "−")
    return f'<span class="tick {axis}" style="{side}:{100.0 * share:.2f}%">{text}</span>'


def _path(px: Sequence[float], py: Sequence[float], x: Array) -> str:
    corners = zip(_begins(x), px, py, strict=True)
    return "".join(f"{'M' if begins else 'L'}{a:.1f} {b:.1f}" for begins, a, b in corners)


def _begins(x: Array) -> NDArray[np.bool_]:
    """(n,) where a curve begins anew: at its first point, and after a gap."""
    steps = np.diff(x)
    longest = max(LONGEST_STEP_S, 4.0 * float(np.median(steps))) if len(steps) else 0.0
    out = np.ones(len(x), dtype=bool)
    out[1:] = ~((steps >= 0.0) & (steps <= longest))
    return out
