"""The six without the effects that were found, from the sums in which they are columns.

Whether missing physics matters is asked of one set of sums: the same flight, linearisation and
noise, with the columns of what was found, and without them.  Two engines that each found their own
noise differ by more than the physics between them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.records import Plain
from onboard.core.estimate.calibration_model import calibration_model
from onboard.core.estimate.calibration_record import six_covariance
from onboard.core.estimate.solution import solve
from onboard.core.maths.accelerometer import parameters_of
from onboard.core.maths.arrays import vector3
from onboard.core.maths.blocks import Block
from onboard.core.physics.effect import Effect


def plain_six(final: Examination, families: Sequence[Effect]) -> Plain:
    """What the six would be, and be claimed to be, had ``families`` not been found.

    A nuisance that one of them displaced (the antenna some centimetres off, for the antenna
    elsewhere) is there again: its columns are the same, its prior is its own.

    Args:
        final: the model with them.
        families: effects whose columns are in it.
    """
    model = calibration_model(final.point, final.prior, final.settings.needs)
    stands_for = {f.instead_of: f.name for f in families if f.instead_of}
    index = [
        i
        for f in model.families
        for i in range(
            *final.model.slices[stands_for.get(f.name, f.name)].indices(final.model.size)
        )
    ]
    at = final.absent
    at[index] = 0.0
    solution = solve(
        [Block(p.start, p.end, p.sums.shifted(at).subset(index)) for p in final.all_blocks],
        model,
    )
    value = parameters_of(solution.theta)
    sigma = np.sqrt(np.diag(six_covariance(solution)))
    return Plain(
        (*vector3(value[:3]), *vector3(value[3:])),
        (*vector3(sigma[:3]), *vector3(sigma[3:])),
    )
