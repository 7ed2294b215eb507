"""At rest an accelerometer feels gravity and nothing else: a truth that no flight has seen.

The estimator uses no ground.  Before take-off and after landing the vehicle stands, and whatever
its attitude, ``|scale (raw - offset)|`` has to be the gravity with which the flight was estimated:
neither GPS, attitude, timing nor the vehicle's motion are in it.  It asks for one number of six, in
the direction in which the vehicle stands, which is what a hover shows best.  An accelerometer that
warms up, and one that vibration shifts in flight, rest at something else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.real.command import fit_and_show
from benchmarks.real.flights import Fit
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array, vector3
from onboard.core.maths.earth import STANDARD_GRAVITY


@dataclass(frozen=True, slots=True)
class Rest:
    """What an accelerometer reads more than gravity where it stands, m/s^2.

    Attributes:
        flight: its name.
        imu: accelerometer.
        in_force: with the parameters in force.
        estimate: with those that were estimated in flight.
        sigma: of that, as the estimate claims.
        offered: with what a person is told to set; NaN if that is nothing.
    """

    flight: str
    imu: int
    in_force: float
    estimate: float
    sigma: float
    offered: float

    @property
    def off(self) -> float:
        """In sigmas."""
        return self.estimate / self.sigma


def run(made: Sequence[Fit]) -> list[Rest]:
    """Of every accelerometer that was seen standing."""
    return [rest_of(f) for f in made if not f.failed and np.all(np.isfinite(f.rest))]


def rest_of(fit: Fit) -> Rest:
    """Of one accelerometer."""
    raw = _six(fit.in_force).undo(fit.rest)
    scale, offset = fit.estimate[:3], fit.estimate[3:]
    felt = scale * (raw - offset)
    offered = np.full(3, np.nan)
    if fit.offer is not None and fit.offer.offered:
        offered = _six(fit.offer.six).apply(raw)
    along = felt / np.linalg.norm(felt)
    slope = np.concatenate([along * (raw - offset), -along * scale])
    return Rest(
        fit.flight,
        fit.imu,
        float(np.linalg.norm(fit.rest)) - STANDARD_GRAVITY,
        float(np.linalg.norm(felt)) - STANDARD_GRAVITY,
        float(np.sqrt(slope @ fit.covariance @ slope)),
        float(np.linalg.norm(offered)) - STANDARD_GRAVITY,
    )


def _six(values: Array) -> SixParameters:
    return SixParameters(vector3(values[:3]), vector3(values[3:]))


def table(rests: Sequence[Rest]) -> str:
    """One line for each accelerometer, and what they come to."""
    if not rests:
        return "nobody was seen standing"
    head = (
        f"{'flight, IMU':26}{'in force':>10}{'estimate':>10}{'sigma':>8}{'off':>7}{'offered':>10}"
    )
    lines = [
        f"{r.flight[:22]:23}{r.imu:3}{r.in_force:10.3f}{r.estimate:10.3f}{r.sigma:8.3f}{r.off:7.1f}"
        + ("" if np.isnan(r.offered) else f"{r.offered:10.3f}")
        for r in rests
    ]
    before, after, off = (
        float(np.sqrt(np.mean(np.square([getattr(r, n) for r in rests]))))
        for n in ("in_force", "estimate", "off")
    )
    end = (
        f"root mean square {before:.3f} in force, {after:.3f} estimated, {off:.2f} sigma; those of "
        "one flight are not independent"
    )
    some = [r for r in rests if not np.isnan(r.offered)]
    if some:
        then = float(np.sqrt(np.mean([r.offered**2 for r in some])))
        now = float(np.sqrt(np.mean([r.in_force**2 for r in some])))
        end += f"\nof {len(some)} with something offered: {now:.3f} in force, {then:.3f} as offered"
    return "\n".join([head, *lines, end])


def show(made: Sequence[Fit]) -> None:
    """Print the table."""
    print(table(run(made)))


def main(arguments: list[str] | None = None) -> None:
    """Fit and print."""
    fit_and_show("Accelerometers at rest, which no flight has seen.", show, arguments)


if __name__ == "__main__":
    main()
