"""Accelerometers of one vehicle compared: for other programs, and in sentences for people."""

from __future__ import annotations

import math
from collections.abc import Iterator

import msgspec
import numpy as np

from onboard.answers.document_numbers import finite, numbers
from onboard.answers.replay_document import AccelerometersDocument, JointDocument, PairDocument
from onboard.core.estimate.common_cause import in_words
from onboard.core.estimate.comparison import Comparison, PairDifference
from onboard.core.estimate.joint import Joint
from onboard.core.maths.arrays import vector3

FAR_M = 0.05
"""A sensor that is further from its configured place than this is worth a word, m [physics: twice
what a person with a ruler is off]."""
FAR_SIGMAS = 5.0
"""And by so many sigmas [probability: 6e-7 an axis]."""


def accelerometers_document(
    comparison: Comparison | None,
) -> AccelerometersDocument | msgspec.UnsetType:
    """The comparison as other programs read it; unset where there is none."""
    if comparison is None:
        return msgspec.UNSET
    return AccelerometersDocument(
        pairs=[_pair(pair) for pair in comparison.pairs],
        joint=[_joint(comparison.joint, imu) for imu in comparison.joint.imus],
        common_cause=list(common_cause(comparison)),
    )


def common_cause(comparison: Comparison) -> tuple[str, ...]:
    """What all accelerometers ask for alike, and what is rather to blame: sentences."""
    return in_words(comparison.common, len(comparison.joint.imus), comparison.vertical)


def remarks(comparison: Comparison | None) -> tuple[str, ...]:
    """What a comparison has to say to a person, in sentences; none where all is well."""
    if comparison is None:
        return ()
    return (*common_cause(comparison), *_misplaced(comparison))


def _misplaced(comparison: Comparison) -> Iterator[str]:
    """Accelerometers that are not where the parameters have them: one to blame, or a pair."""
    far = {pair.imus: off for pair in comparison.pairs if (off := _off(pair))}
    for imu in comparison.joint.imus:
        mine = {pair.imus for pair in comparison.pairs if imu in pair.imus}
        if len(mine) > 1 and far.keys() == mine:
            signs = {imus: 1.0 if imus[0] == imu else -1.0 for imus in mine}
            off = {
                axis: sum(signs[imus] * far[imus].get(axis, 0.0) for imus in mine) / len(mine)
                for axis in "xyz"
                if any(axis in far[imus] for imus in mine)
            }
            yield (
                f"accelerometer {imu} is {_metres(off)} from where INS_POS{imu} has it, as the "
                "others have it"
            )
            return
    for (a, b), off in far.items():
        yield (
            f"seen from accelerometer {b}, accelerometer {a} is {_metres(off)} from where "
            f"INS_POS{a} and INS_POS{b} have it"
        )


def _off(pair: PairDifference) -> dict[str, float]:
    """By axis how much further the first is from the second than configured, where it is far."""
    found = zip("xyz", pair.distance, pair.distance_sigma, strict=True)
    return {axis: d for axis, d, s in found if abs(d) > max(FAR_M, FAR_SIGMAS * s)}


def _metres(off: dict[str, float]) -> str:
    return " and ".join(f"{d:+.2f} m in {axis}" for axis, d in off.items())


def _pair(pair: PairDifference) -> PairDocument:
    return PairDocument(
        imus=list(pair.imus),
        windows=pair.windows,
        in_force_m_s2=numbers(pair.in_force),
        estimated_m_s2=numbers(pair.estimated),
        own_m_s2=numbers(pair.own),
        own_sigma_m_s2=numbers(pair.own_sigma),
        chi_square=finite(pair.chi_square),
        p_value=finite(pair.p_value) if math.isfinite(pair.chi_square) else None,
        distance_m=numbers(pair.distance),
        distance_sigma_m=numbers(pair.distance_sigma),
    )


def _joint(joint: Joint, imu: int) -> JointDocument:
    six, covariance = joint.of(imu)
    sigma = np.sqrt(np.diag(covariance))
    return JointDocument(
        imu=imu,
        scale=numbers(vector3(six[:3])),
        offset=numbers(vector3(six[3:])),
        scale_sigma=numbers(vector3(sigma[:3])),
        offset_sigma=numbers(vector3(sigma[3:])),
    )
