"""Numbers in words: how sizes of effects are said, in digits that their sigmas support."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from onboard.core.physics.finding import Quantity

UNKNOWN = "not known"
DEGREE = math.pi / 180.0
SURE = 3.0
"""Sigmas from which one of several unknowns is worth a word: 0.3 % come so far by chance."""
MOST_DECIMALS = 6


def fixed(value: float, places: int) -> str:
    """``value`` with ``places`` decimals; words where it is not finite."""
    if not math.isfinite(value):
        return UNKNOWN
    rounded = round(value, places) + 0.0  # no minus before a zero
    return f"{rounded:.{places}f}".replace("-", "−")


def listed(parts: Sequence[str]) -> str:
    """``a``; ``a and b``; ``a, b and c``."""
    *most, last = parts
    return f"{', '.join(most)} and {last}" if most else last


def unit_in_words(unit: str) -> str:
    """A unit with raised digits; nothing for a plain number."""
    return "" if unit in ("1", "-") else unit.replace("^2", "²").replace("^3", "³")


def places(sigma: float) -> int:
    """Decimals down to the first digit of a sigma."""
    if not math.isfinite(sigma) or sigma <= 0.0:
        return 3
    return min(max(0, -math.floor(math.log10(sigma))), MOST_DECIMALS)


def measured(q: Quantity, factor: float = 1.0, unit: str | None = None) -> str:
    """Value and sigma to the first digit of sigma, times ``factor``, with a unit."""
    value, sigma = factor * q.value, factor * q.sigma
    decimals = places(sigma)
    unit = unit_in_words(q.unit) if unit is None else unit
    spread = f" ± {sigma:.{decimals}f}" if math.isfinite(sigma) and sigma > 0.0 else ""
    return f"{fixed(value, decimals)}{spread}{unit if unit == '°' else f' {unit}'}".rstrip()


def sure(unknowns: Mapping[str, Quantity]) -> dict[str, Quantity]:
    """Those unknowns that are larger than chance; the largest if none is."""
    out = {k: q for k, q in unknowns.items() if abs(q.value) > SURE * q.sigma}
    if out or not unknowns:
        return out
    most = max(unknowns, key=lambda k: abs(unknowns[k].value))
    return {most: unknowns[most]}


def each(unknowns: Mapping[str, Quantity], factor: float = 1.0, unit: str | None = None) -> str:
    """``x 0.12, z −0.3 m/s²``: the unknowns that are sure, with one unit at the end."""
    named = sure(unknowns)
    if not named:
        return ""
    first = next(iter(named.values()))
    unit = unit_in_words(first.unit) if unit is None else unit
    parts = [f"{k} {fixed(factor * q.value, places(factor * q.sigma))}" for k, q in named.items()]
    return f"{', '.join(parts)}{unit if unit == '°' else f' {unit}'}".rstrip()


def jumped(unknowns: Mapping[str, Quantity], factor: float = 1.0, unit: str | None = None) -> str:
    """``at 84 s by x 0.31 m/s²``: the time, where it is known, and the rest as of :func:`each`."""
    at = unknowns.get("time")
    when = f"at {at.value:.0f} s " if at else ""
    rest = {k: q for k, q in unknowns.items() if k != "time"}
    return f"{when}by {each(rest, factor, unit)}"


def first(unknowns: Mapping[str, Quantity]) -> Quantity:
    """The only unknown, or the first of several."""
    return next(iter(unknowns.values()))


def times(count: int) -> str:
    """``, 3 times``; nothing for once."""
    return f", {count} times" if count > 1 else ""
