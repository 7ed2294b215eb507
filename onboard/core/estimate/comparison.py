"""The accelerometers of one vehicle compared: pairs, all of them together, what they ask alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from onboard.core.estimate.common_cause import CommonChange, common_changes
from onboard.core.estimate.joint import Joint, Single, disagreement, joint, single
from onboard.core.estimate.observability import Needs
from onboard.core.estimate.relative import Relative, relative_of
from onboard.core.estimate.result import Calibration, Status
from onboard.core.estimate.shared_windows import one_after_another, shared_windows
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Vector3, vector3
from onboard.core.maths.chi_square import survival


@dataclass(frozen=True, slots=True)
class PairDifference:
    """Mean force of accelerometer a less that of b over the flight, sensor axes, m/s^2.

    What their configured places do is taken out: a right calibration leaves nothing but what
    the unknown rest of their distance does.

    Attributes:
        imus: accelerometers a and b.
        in_force: with the parameters in force.
        estimated: with each one's own estimate.
        own: as the pair itself has it, without GPS.
        own_sigma: of that.
        chi_square: of the two estimates against it, three degrees of freedom.
        distance: by how much a is further from b than configured, body axes, m.
        distance_sigma: of that.
        windows: of about a second, how many were compared.
    """

    imus: tuple[int, int]
    in_force: Vector3
    estimated: Vector3
    own: Vector3
    own_sigma: Vector3
    chi_square: float
    distance: Vector3
    distance_sigma: Vector3
    windows: int

    @property
    def p_value(self) -> float:
        """Probability of a larger chi-square."""
        return survival(self.chi_square, 3)


@dataclass(frozen=True, slots=True)
class Comparison:
    """What the accelerometers of a vehicle say of each other.

    Attributes:
        pairs: every two of them.
        joint: all of them together.
        common: changes of an offset that all of them ask for.
        vertical: axis along gravity in level flight, 0, 1 or 2.
        relatives: every two of them, as :attr:`pairs`, with the sums.
    """

    pairs: tuple[PairDifference, ...]
    joint: Joint
    common: tuple[CommonChange, ...]
    vertical: int
    relatives: tuple[Relative, ...]


def compare(
    calibrations: Sequence[Calibration],
    flights: Sequence[Mapping[int, Sequence[Batch]]],
    needs: Needs | None = None,
) -> Comparison | None:
    """Compare the accelerometers of one vehicle; None if no two of them share enough flight.

    Args:
        calibrations: of each by itself; they stay as they are.
        flights: what each accelerometer kept of each of some flights, by accelerometer.
        needs: smaller common changes of an offset than its target are not worth a word.
    """
    usable = [c for c in calibrations if c.status is not Status.INVALID and _flew(c.imu, flights)]
    singles = {s.imu: s for s in map(single, usable) if s is not None}
    pairs: list[PairDifference] = []
    relatives: list[Relative] = []
    for a, b in combinations(singles.values(), 2):
        if not any({a.imu, b.imu} <= f.keys() for f in flights):
            continue
        relative = relative_of(
            (a.imu, b.imu),
            one_after_another(
                [shared_windows(f[a.imu], f[b.imu]) for f in flights if {a.imu, b.imu} <= f.keys()]
            ),
            np.concatenate([a.before, b.before]),
            np.concatenate([a.prior_sigma, b.prior_sigma]),
        )
        if relative is not None:
            relatives.append(relative)
            pairs.append(_difference(relative, a, b))
    if not pairs:
        return None
    together = {imu for pair in pairs for imu in pair.imus}
    found = joint([s for s in singles.values() if s.imu in together], relatives)
    # Where nobody says what is in force, nobody says what a change is.
    known = all(c.parameters_known for c in usable)
    least = float((needs or Needs()).target[3])
    common = common_changes(found, least) if known else ()
    vertical = int(np.argmax(np.abs(relatives[0].mean_force)))
    return Comparison(tuple(pairs), found, common, vertical, tuple(relatives))


def _flew(imu: int, flights: Sequence[Mapping[int, Sequence[Batch]]]) -> bool:
    return any(imu in flight for flight in flights)


def _difference(relative: Relative, a: Single, b: Single) -> PairDifference:
    spread = np.diag(relative.covariance)[12:]
    return PairDifference(
        imus=relative.imus,
        in_force=vector3(relative.difference(a.before, b.before)),
        estimated=vector3(relative.difference(a.estimate, b.estimate)),
        own=vector3(relative.own),
        own_sigma=vector3(np.sqrt(np.diag(relative.own_covariance))),
        chi_square=disagreement(relative, a, b),
        distance=vector3(relative.distance),
        distance_sigma=vector3(np.sqrt(spread)),
        windows=relative.windows,
    )
