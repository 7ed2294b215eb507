"""An accelerometer whose reading depends on where the load came from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from typing import Self

import numpy as np

from onboard.core.inputs.segments import Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain
from onboard.core.maths.medians import NORMAL_MEDIAN
from onboard.core.model.quadrature import NodeMaker, Signals
from onboard.core.physics.effect import AXES, Bearing, Effect, Origin
from onboard.core.physics.octaves import WEIGHTS, sigma_of_shapes

PLAYS = (0.5, 1.0, 2.0)
"""Half-widths of the plays, m/s^2, an octave apart: what lies between two is much like both.  A
narrower one is driven by what vibration leaves after the autopilot's low-pass; a wider one is run
through by few flights, and to the others it is a scale [physics]."""
LARGEST = 1.0
"""Half the height of the largest loop that is believed, m/s^2 [assumed]."""
AS_READ = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
"""Scale and beta of a raw force that is taken as it is."""
SHAPES = ("narrow", "ends")
"""Names of the shapes: more of the narrow play than of the wide, more of both than in between."""
MOST_TAKEN_BACK = 0.8
"""Share of a rise of the load that its branches may take back again: at one, the reading stands
still while the load rises, and nothing can tell the load from it [physics]."""
MOST_NOISE = 0.03 * PLAYS[0]
"""Noise of a reading that drags no follower about, m/s^2: more than that, and a follower rides on
the peaks, its branch is too small, and the loop would be found too high by some per cent
[physics]."""
LONGEST_MEAN_S = 0.15
"""Readings are averaged over no more than this, s: what vehicles do takes longer [physics]."""


class AccelerometerHysteresis(Effect):
    """Reading that lags behind the load: too small while it rises, too large while it falls.

    How wide the loop is nobody knows beforehand.  Each axis reads a weighted sum of the branches of
    three play operators, one for each half-width of :data:`PLAYS`: a play has a follower that the
    load drags along once it is that far away from it, and which remembers its place from segment to
    segment.  The sum of the weights is half the height of the loop; how it is shared among the
    plays is the loop's shape, an unknown too, so that the height's sigma holds it.  A loop costs
    energy each time that it is gone round (second law of thermodynamics), and so is run through one
    way: the reading is behind, and never ahead.
    """

    effect = "accelerometer_hysteresis"
    code = 22
    title = "The accelerometer lags behind the load"
    sentence = "the accelerometer's reading depends on where the load came from"
    meaning = "`x`, `y`, `z`, m/s²: half the height of the loop, too small on the way up"
    bearing = Bearing.WITHIN
    source = "play operators of Prandtl and Ishlinskii; hysteresis error of IEEE Std 1293"
    cure = "ArduPilot has no parameter for it: replace the sensor"
    apart = "load and unload in turn: steep turns both ways, accelerate and brake, climb and dive"
    changes_force = True
    positive = True

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        super().__init__(origin)
        self.take_axes("m/s^2", LARGEST)
        shapes = [f"{shape}_{a}" for shape in SHAPES for a in AXES]
        self.take_shapes(shapes, "m/s^2", sigma_of_shapes(LARGEST))
        self.weights = np.zeros((3, len(PLAYS)))
        self.beside: tuple[tuple[Effect, Array], ...] = ()

    def about(self, size: Array, beside: Sequence[tuple[Effect, Array]] = ()) -> Self:
        """The followers of the load that is left when ``size`` (9,) is taken off what was read.

        An offset that follows the throttle moves no follower, large as it may be to a play.
        """
        made = copy(self)
        made.beside = tuple(beside)
        made.weights = _invertible(size.reshape(len(WEIGHTS), 3).T @ WEIGHTS)
        return made

    def remembers(self, segment: Segment, before: Signal | None) -> Signal:
        """Where the followers are against the load, (n, 9): -1 while it rises and 1 while it falls.

        Play by play of x, then of y and z.  A raw force will do: a scale is a per cent, and an
        offset moves load and followers alike.
        """
        read = segment.raw_s @ segment.R_bs.T
        if self.beside:
            nodes = NodeMaker(segment, np.zeros(3), AS_READ).signals(segment.t)
            read = read + sum(
                added @ size
                for other, size in self.beside
                if (added := other.acceleration(nodes)) is not None
            )
        f_b = _averaged(segment.t, read)
        count = len(PLAYS)
        places = np.zeros((3, count))
        if before is not None:
            t, x = before
            places = np.array([np.interp(segment.t[0], t, b) for b in x.T]).reshape(3, count)
        branches = [_branches(f_b[:, j], places[j], self.weights[j]) for j in range(3)]
        return segment.t, np.hstack(branches)

    def acceleration(self, nodes: Signals) -> Array:
        """``-h_i e_i`` with the mean branch ``h`` of the plays, then the same of each shape."""
        branches = nodes.slow(self.name)
        if branches is None:
            return np.zeros((*nodes.t.shape, 3, len(self.unknowns)))
        mixed = (branches.reshape(-1, len(PLAYS)) @ WEIGHTS.T).reshape(*nodes.t.shape, 3, -1)
        out = np.zeros((*nodes.t.shape, 3, len(WEIGHTS), 3))
        for axis in range(3):
            out[..., axis, :, axis] = -mixed[..., axis, :]
        return out.reshape(*nodes.t.shape, 3, len(self.unknowns))


def _invertible(weights: Array) -> Array:
    """Weights (axis, play), made smaller where the reading would not rise with the load.

    While the narrower plays are dragged along and the wider ones rest, the resting ones take back
    their weights over their half-widths of what the load rises by.
    """
    taken_back = np.cumsum((weights / PLAYS)[:, ::-1], axis=1).max(axis=1)
    out: Array = weights / np.maximum(1.0, taken_back / MOST_TAKEN_BACK)[:, None]
    return out


def _averaged(t: Array, f_b: Array) -> Array:
    """Readings (n, 3) averaged over as many samples as their noise asks for; over one if it is nil.

    The noise is that of second differences, in which a load that goes straight is not.
    """
    if len(t) < 3:
        return f_b
    noise = np.median(np.abs(np.diff(f_b, 2, axis=0)), axis=0) / (NORMAL_MEDIAN * math.sqrt(6.0))
    step = float(t[-1] - t[0]) / (len(t) - 1)
    most = min(int(0.5 * LONGEST_MEAN_S / step), len(t) - 1)
    out = f_b.copy()
    for j in range(3):
        beside = min(math.ceil(0.5 * ((noise[j] / MOST_NOISE) ** 2 - 1.0)), most)
        if beside > 0:
            # Turned about its ends, a straight line goes on straight.
            x = f_b[:, j]
            before = 2.0 * x[0] - x[beside:0:-1]
            padded = np.concatenate([before, x, 2.0 * x[-1] - x[-2 : -beside - 2 : -1]])
            count = 2 * beside + 1
            out[:, j] = np.convolve(padded, np.full(count, 1.0 / count), mode="valid")
    return out


def _branches(reading: Array, start: Array, weights: Array) -> Array:
    """The followers less the load (n, plays), each in units of its play, by exact inversion.

    The reading is the load, and the weighted branches on top of it.  From sample to sample it is a
    line of straight pieces over the load, and a new piece begins where another play begins to be
    dragged.  They do so in the order of their widths: two followers are never further from each
    other than one play is wider than the other.

    Args:
        reading: (n,) of one axis, m/s^2.
        start: (plays,) branches at the first reading.
        weights: (plays,) as far as they are known, m/s^2.
    """
    plays = np.array(PLAYS)
    if not np.any(weights):
        followers = _dragged(reading, float(reading[0]) + start * plays)
        known: Array = (followers - reading[:, None]) / plays
        return known
    shares = (weights / plays).tolist()
    followers = (float(reading[0]) - start @ weights + start * plays).tolist()
    narrowest, at_rest = PLAYS[0], 1.0 - sum(shares)
    held = sum(share * place for share, place in zip(shares, followers, strict=True))
    out = []
    for read in reading.tolist():
        load = (read - held) / at_rest
        if not -narrowest <= load - followers[0] <= narrowest:  # else all of them rest
            up = 1.0 if load > followers[0] else -1.0
            free, rising, dragged = read - held, at_rest, 0
            for share, place, play in zip(shares, followers, PLAYS, strict=True):
                if (load - place) * up <= play:
                    break
                # Dragged along, it is its play away and takes back no more.
                free += share * (place + up * play)
                rising += share
                load = free / rising
                dragged += 1
            for k in range(dragged):
                place = load - up * PLAYS[k]
                held += shares[k] * (place - followers[k])
                followers[k] = place
        out.append((load, *followers))
    found = np.array(out)
    branches: Array = (found[:, 1:] - found[:, :1]) / plays
    return branches


def _dragged(load: Array, followers: Array) -> Array:
    """Followers (n, plays) of a load (n,) that is known: each for itself, without a loop over n.

    A follower is held between ``load - play`` and ``load + play``.  Two such holds in a row are one
    hold between other limits, so the limits since the beginning of 1, 2, 4, ... samples follow from
    each other.

    Args:
        load: m/s^2.
        followers: (plays,) where they begin, m/s^2.
    """
    plays = np.array(PLAYS)
    loops = compiled_loops()
    if loops is not None:
        out = np.empty((len(load), len(plays)))
        loops.dragged(plain(load), plain(followers), plays, out)
        return out
    low, high = load[:, None] - plays, load[:, None] + plays
    reach = 1
    while reach < len(load):
        later = slice(reach, None)
        before_low, before_high = low[:-reach], high[:-reach]
        low[later], high[later] = (
            np.clip(before_low, low[later], high[later]),
            np.clip(before_high, low[later], high[later]),
        )
        reach *= 2
    return np.clip(followers, low, high)
