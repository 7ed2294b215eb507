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

from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.medians import middle
from onboard.core.model.linearisation import SHAPES
from onboard.core.model.smoothing import (
    RESOLVED_S,
    Combination,
    Gained,
    averaged,
    averaged_place,
    change,
    lagged,
    lagged_place,
    mean,
    paired,
    paired_place,
    slope,
    times,
    weight_of_two,
)

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
        force: (K, 3) what the response changes by with time, m/s^2.
        slope: (K, 3) what it changes by with ``window^2``, m/s^3.
        place: (K, 3) what it makes of the place less that at the epoch, m.
        places: (4, K, 3) the other shapes' of the place less the even mean's, m.
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
        step = velocity.step
        self.apart = min(middle(np.diff(t)), reach) if len(t) > 1 else 0.0
        shapes = _velocities(window, self.apart, step)
        shaped = _shared(shares, shapes)
        force = mean(window, step) + change(shaped, LATER_S)
        along = slope(window, 2.0 * reach, step)
        places = _places(window, self.apart)
        place = averaged_place(window) + _shared(shares, places)
        seen = velocity.seen(t, [*shapes, *places, shaped, force, along, place], window)
        self.shapes: Array = seen[: len(SHAPES)]
        self.places: Array = seen[len(SHAPES) : 2 * len(SHAPES)]
        self.shaped, self.force, self.slope, self.place = seen[2 * len(SHAPES) :]
        if shaped and window >= RESOLVED_S:
            widths = (1.0 + WIDER) * window, (1.0 - WIDER) * window
            shares_wide, shares_narrow = (
                velocity.seen(t, [_shared(shares, _velocities(width, self.apart, step))], width)[0]
                for width in widths
            )
            self.slope += (shares_wide - shares_narrow) / (widths[0] ** 2 - widths[1] ** 2)


def _velocities(window: float, apart: float, step: float) -> list[Combination]:
    """The four shapes less the even mean over ``window``, s, of epochs ``apart``, s."""
    even, late = averaged(window, step), lagged(window)
    return _less_even(even, partial(paired, window), late, weight_of_two(window, apart))


def _places(window: float, apart: float) -> list[Combination]:
    """The same of the place."""
    even, late = averaged_place(window), lagged_place(window)
    return _less_even(even, partial(paired_place, window), late, weight_of_two(window, apart))


def _less_even(
    even: Combination, pair: Callable[[float], Combination], late: Combination, less: float
) -> list[Combination]:
    """Two moments, of which the older weighs ``less`` or so much more, and a lag, less ``even``."""
    if less <= 0.0:
        return [()] * len(SHAPES)
    less_even = times(-1.0, even)
    return [
        pair(less) + less_even,
        pair(1.0 - less) + less_even,
        times(0.5, pair(0.25)) + times(-0.5, pair(0.75)),
        late + less_even,
    ]


def _shared(shares: Array, shapes: list[Combination]) -> Combination:
    """What shares (4,) of the shapes make together."""
    some = zip(shares.tolist(), shapes, strict=True)
    return tuple(term for share, shape in some if share for term in times(share, shape))
