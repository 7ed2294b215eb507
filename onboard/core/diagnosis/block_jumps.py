"""Jumps at the starts of blocks: where to look, by algebra on the sums that are there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.limits import SETTLED_S
from onboard.core.diagnosis.selection import Fitter
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import NormalSums
from onboard.core.model.regressors import Family, Model, Unknown
from onboard.core.physics.effects.bias_step import LARGEST

OFFSETS = (3, 4, 5)
"""Columns of the offsets among the six."""


class _Jump(Family):
    """Names for the columns of :func:`stepped`; nothing is evaluated."""

    name = "jump"

    def __init__(self, unknowns: tuple[Unknown, ...]) -> None:
        self.unknowns = unknowns


def stepped(fitter: Fitter, boundary: int) -> Fitter:
    """The same with three more columns at the end: offsets that jump at a block's start.

    The jump is the offset's own columns in the blocks from ``boundary`` on; the filter's
    memory blurs that by some seconds, which is enough to know where to look closer.
    """
    m = fitter.model.size
    unknowns = tuple(Unknown(f"jump_{a}", "m/s^2", 0.0, LARGEST) for a in "xyz")
    model = Model([*fitter.model.families, _Jump(unknowns)])
    after = [*range(m), *OFFSETS]
    blocks = []
    for i, p in enumerate(fitter.blocks):
        sums, own = NormalSums.zeros(m + 3), p.sums
        sums.s, sums.rows, sums.log_det = own.s, own.rows, own.log_det
        sums.G[:m, :m] = own.G
        if i >= boundary:
            sums.N[:] = own.N[np.ix_(after, after)]
            sums.b[:] = own.b[after]
        else:
            sums.N[:m, :m], sums.b[:m] = own.N, own.b
        blocks.append(Block(p.start, p.end, sums))
    return Fitter(blocks, model, np.concatenate([fitter.absent, np.zeros(3)]))


def jumps_of_blocks(fitter: Fitter, free: Sequence[int]) -> list[tuple[int, float]]:
    """Blocks at whose start a jump of the offsets would help: (block, gain).

    Not while an EKF that has just begun converges: its attitude jumps then.
    """
    index, offsets = list(free), list(OFFSETS)
    information = np.concatenate([fitter.prior_information[index], np.full(3, LARGEST**-2)])
    prior = np.diag(information)
    mean = np.concatenate([fitter.model.prior[index], np.zeros(3)])
    at = fitter.absent.copy()
    at[index] = 0.0
    base = fitter.fit(index, held_out=False)
    shifted, after = fitter.sums.shifted(at), None
    settled = settled_from(fitter.blocks)
    out = []
    for i in range(len(fitter.blocks) - 1, 0, -1):
        p = fitter.blocks[i].sums.shifted(at)
        after = p if after is None else after + p
        if fitter.blocks[i].start < settled:
            continue
        N = np.block(
            [
                [
                    shifted.signal[np.ix_(index, index)],
                    after.N[np.ix_(index, offsets)],
                ],
                [after.N[np.ix_(offsets, index)], after.N[np.ix_(offsets, offsets)]],
            ]
        )
        b = np.concatenate([shifted.b[index], after.b[offsets]])
        theta = np.linalg.solve(N + prior, b + prior @ mean)
        off = theta - mean
        N[: len(index), : len(index)] += shifted.G[np.ix_(index, index)]
        chi2 = shifted.s - 2 * theta @ b + theta @ N @ theta + off @ prior @ off
        out.append((i, float(base.chi2 - chi2)))
    return out


def settled_from(blocks: Sequence[Block]) -> float:
    """When jumps may begin, s on the boot clock: when there is flight before them.

    Not while an EKF that has begun with the autopilot converges: its attitude jumps then.
    """
    return max(blocks[0].end, SETTLED_S)
