"""How a receiver weighs what is in the span that it averages its velocity over.

An even mean, and shares of other shapes that spread alike
(:data:`~onboard.core.model.linearisation.SHAPES`): two moments as far apart as the epochs, of which
the newer or the older weighs more; what two moments do whichever way they lean; and a first-order
lag.  With shares that are taken in, what the response changes by with time and span is that of the
whole.  Held to the even mean's, shares and span that are both off chase each other: on flights of
ArduPilot's simulator in turbulence the span went on by a tenth of its way in each pass, or to and
fro, and scale and offset of z were up to five sigma off.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.smoothing import RESOLVED_S, Gained, weight_of_two

LATER_S: Final = 0.01
"""s to either side at which a response is looked at for how it changes [cost: no sample resolves
it]."""
WIDER: Final = 0.02
"""Share of the span by which it is looked at for what it changes by with the span [cost]."""


class Response:
    """What is made of a velocity that is gained, at K epochs, in the axes that it is gained in.

    Attributes:
        shapes: (4, K, 3) the other shapes less the even mean over the span, m/s.
        shaped: (K, 3) what their shares make of it, m/s.
        apart: from one epoch to the next, s, as far as the velocity is known.
    """

    def __init__(
        self, velocity: Gained, t: Array, window: float, shares: Array, reach: float
    ) -> None:
        """Take the epochs.

        Args:
            velocity: that a receiver reports, at its antenna.
            t: (K,) s, in order.
            window: span, s.
            shares: (4,) of the shapes.
            reach: to either side of an epoch in which the velocity is known, s.
        """
        self._velocity, self._t, self._window, self._shares = velocity, t, window, shares
        self._longest = 2.0 * reach
        self.apart = min(float(np.median(np.diff(t))), reach) if len(t) > 1 else 0.0
        moments = [t, t + LATER_S, t - LATER_S] if shares.any() else [t]
        looked = self._less_even(window, np.concatenate(moments)).reshape(4, len(moments), -1, 3)
        self.shapes: Array = looked[:, 0]
        self.shaped: Array = np.tensordot(shares, self.shapes, axes=1)
        self._near: Array = np.tensordot(shares, looked[:, 1:], axes=1)

    def force(self) -> Array:
        """(K, 3) what the response changes by with time, m/s^2."""
        out = self._velocity.mean(self._t, self._window)
        if len(self._near):
            after, before = self._near
            out += (after - before) / (2.0 * LATER_S)
        return out

    def slope(self) -> Array:
        """(K, 3) what it changes by with ``window^2``, m/s^3."""
        out = self._velocity.slope(self._t, self._window, self._longest)
        if self._shares.any() and self._window >= RESOLVED_S:
            wide, narrow = (self._window * x for x in (1.0 + WIDER, 1.0 - WIDER))
            change = self._less_even(wide, self._t) - self._less_even(narrow, self._t)
            out += np.tensordot(self._shares, change, axes=1) / (wide**2 - narrow**2)
        return out

    def _less_even(self, window: float, t: Array) -> Array:
        """(4, k, 3) the shapes less the even mean over ``window``, s, about times ``t`` (k,)."""
        v, less = self._velocity, weight_of_two(window, self.apart)
        out = np.zeros((4, len(t), 3))
        if less <= 0.0:
            return out
        even = v.averaged(t, window)
        newer, older, most_new, most_old = v.paired(t, window, (less, 1.0 - less, 0.25, 0.75))
        out[0], out[1] = newer - even, older - even
        out[2] = 0.5 * (most_new - most_old)
        out[3] = v.lagged(t, window) - even
        return out
