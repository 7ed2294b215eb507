"""What a receiver that averages over a span does to the velocity it reports.

A receiver whose velocity is the mean over ``window`` seconds centred on the epoch reports
``V + (window^2 / 24) V'' + ...``.  Written with the specific force around the epoch the exact
mean is a weighted sum: ``mean(V) - V(t) = integral kappa(s) a(t + s) ds`` with
``kappa(s) = sign(s) (window/2 - |s|) / window`` inside the span.
"""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array

RESOLVED_S = 0.125
"""s; over a shorter span the slope of a force is mostly vibration."""
SECOND_DERIVATIVE_S = 0.12
"""s; to either side, over which a second derivative is taken: shorter is noise, longer misses a
manoeuvre of 1 Hz."""


def mean_weights(offset: Array, window: float) -> Array:
    """Weights of the samples of ``a`` at ``offset`` whose sum is ``mean(V) - V``.

    ``a`` is taken as straight lines between the nodes.  The integral of a function times a hat is
    the second difference of what has the function as its second derivative.

    Args:
        offset: (n,) equidistant s around zero.
        window: s, at most the span of ``offset``.

    Returns:
        (n,) s.
    """
    if window <= 0.0:
        return np.zeros(len(offset))
    step = float(offset[1] - offset[0])
    wider = np.concatenate([[offset[0] - step], offset, [offset[-1] + step]])
    out: Array = np.diff(_twice_integrated(wider, window / 2.0), 2) / step
    return out


def _twice_integrated(s: Array, half: float) -> Array:
    """What has ``kappa`` of a span of twice ``half`` (s) as its second derivative, s."""
    inside = np.minimum(np.abs(s), half)
    cubic = half * inside**2 / 2.0 - inside**3 / 6.0
    beyond = (np.abs(s) - inside) * half**2 / 2.0
    out: Array = np.sign(s) * (cubic + beyond) / (2.0 * half)
    return out


def box_weights(offset: Array, centre: float, width: float) -> Array:
    """Weights (n,) of the mean over ``width`` about ``centre`` of straight lines between nodes.

    Args:
        offset: (n,) equidistant s.
        centre: s.
        width: s; the span lies within that of ``offset``.
    """
    step = offset[1] - offset[0]
    # Rounding: narrower than this, the ends differ by nothing but their last digits.
    width = max(width, 1e-6 * float(step))
    ends = np.array([[centre + 0.5 * width], [centre - 0.5 * width]])
    u = np.clip((ends - offset) / step, -1.0, 1.0)
    # Integral of the hat function of each node up to either end, in steps.
    area = np.where(u < 0.0, 0.5 * (1.0 + u) ** 2, 1.0 - 0.5 * (1.0 - u) ** 2)
    weights: Array = (area[0] - area[1]) * (step / width)
    return weights


def mean_now(offset: Array, window: float) -> Array:
    """Weights (n,) of the derivative of a receiver's averaged velocity to its moment.

    ``d/dt mean(V) = mean(a)``.  The acceleration *at* that moment is mostly vibration, which an
    averaged velocity does not have: as a regressor of the latency it would be noise.
    """
    return box_weights(offset, 0.0, min(window, 2.0 * float(offset[-1])))


def second_difference(offset: Array, window: float = 0.0) -> Array:
    """Weights (n,) of the second derivative at zero over 0.12 s to either side, 1/s^2.

    Args:
        offset: (n,) equidistant s around zero.
        window: s, over which the second derivative is averaged besides.
    """
    # Whole nodes: between them a parabola is not one.
    step = float(offset[1] - offset[0])
    h = step * max(1, round(SECOND_DERIVATIVE_S / step))
    width = min(window, 2.0 * (float(offset[-1]) - h))
    three = [box_weights(offset, centre, width) for centre in (-h, 0.0, h)]
    weights: Array = (three[0] - 2.0 * three[1] + three[2]) / h**2
    return weights


def mean_slope(offset: Array, window: float) -> Array:
    """Derivative of :func:`mean_weights` to ``window^2``; the limit ``V'' / 24`` at zero.

    Args:
        offset: (n,) equidistant s around zero.
        window: s.

    Returns:
        (n,) 1/s.
    """
    # The effect of a shorter span is the second derivative, whose best estimate is that over one
    # which is resolved.
    resolved = max(window, RESOLVED_S)
    if window < resolved:
        limit: Array = mean_weights(offset, resolved) / resolved**2
        return limit
    step = 0.02 * window
    above = mean_weights(offset, min(window + step, 2.0 * offset[-1]))
    below = mean_weights(offset, window - step)
    high = min(window + step, 2.0 * offset[-1])
    slope: Array = (above - below) / (high**2 - (window - step) ** 2)
    return slope
