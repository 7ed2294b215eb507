"""What the likelihood finds on real flights: noise levels, gates, averaging span, whiteness.

A level at a limit, blocks that contradict each other and residuals that are not white all say the
same: the filter's model of noise is not that of the flight.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.real.command import fit_and_show
from benchmarks.real.flights import Fit
from benchmarks.real.whiteness import KINDS
from onboard.core.inputs.reach import NEAR

SANE_GYROSCOPE = 1e-3
"""rad/sqrt(s); ten times a poor MEMS gyroscope: more is something else."""
SANE_INFLATION = 2.0
SHORT = {
    "velocity": "vel",
    "velocity_colour": "col",
    "height": "hgt",
    "height_walk": "hwk",
    "force_walk": "fwk",
    "lift_walk": "lwk",
    "shaken_walk": "shk",
    "shaken_lift": "shl",
    "tilt_walk": "gyro",
    "bias_walk": "bias",
    "attitude": "att",
    "heading": "head",
    "heading_time": "for s",
}
GATES = ("velocity", "recovery", "height", "tilt", "heading")


@dataclass(frozen=True, slots=True)
class Share:
    """How many of how many accelerometers fulfil something."""

    what: str
    count: int
    of: int

    def __str__(self) -> str:
        """As a line."""
        return f"{self.what:54}{self.count:4} of {self.of}"


def run(made: Sequence[Fit]) -> list[Share]:
    """The criteria over all accelerometers that could be fitted."""
    good = [f for f in made if not f.failed]

    def share(what: str, holds: Callable[[Fit], bool], of: Sequence[Fit] = good) -> Share:
        return Share(what, sum(holds(f) for f in of), len(of))

    return [
        share(
            f"gyroscope walk below {SANE_GYROSCOPE:g} rad/sqrt(s)",
            lambda f: f.levels.get("tilt_walk", np.inf) < SANE_GYROSCOPE,
        ),
        share("a noise level at a limit", lambda f: bool(f.at_limit)),
        share(
            "a noise level that is its floor",
            lambda f: bool(f.at_floor),
        ),
        share(
            f"variance inflation below {SANE_INFLATION:g} in the worst direction",
            lambda f: f.inflation < SANE_INFLATION,
        ),
        share(
            f"variance inflation below {SANE_INFLATION:g} of the six numbers",
            lambda f: f.numbers_inflation < SANE_INFLATION,
        ),
        share(f"averaging span clipped at {NEAR.longest_window:g} s", lambda f: f.clipped),
        share("calibrated", lambda f: f.status == "calibrated"),
        share(
            "calibrated, of those that moved",
            lambda f: f.status == "calibrated",
            [f for f in good if f.moved],
        ),
        share("verdict insufficient", lambda f: f.verdict == "insufficient"),
    ]


def _label(f: Fit) -> str:
    return f"{f.flight.removeprefix('real-')[:13]:14}{f.imu} "


def level_table(made: Sequence[Fit]) -> str:
    """Noise levels; ``-`` and ``+`` mark those at a limit, ``.`` those that are their floor."""
    names = list(dict.fromkeys(n for f in made for n in f.levels))
    lines = [f"{'flight, IMU':16}" + "".join(f"{SHORT.get(n, n[:5]):>7}" for n in names)]
    for f in made:
        marks = dict.fromkeys(f.at_floor, ".") | {m[:-1]: m[-1] for m in f.at_limit}
        cells = [f"{f.levels[n]:6.1g}{marks.get(n, ' ')}" for n in names if n in f.levels]
        lines.append(_label(f) + ("".join(cells) or f"  {f.verdict[:60]}"))
    return "\n".join(lines)


def gate_table(made: Sequence[Fit]) -> str:
    """Inflation, averaging span, and what the gates refused or renewed, in per cent.

    Inflation in the worst direction, and of the six numbers.
    """
    lines = [
        f"{'flight, IMU':16}{'worst':>5}{'six':>5}{'span':>5}{'asked':>6}{'used':>5}"
        + "".join(f"{g[:5]:>6}" for g in GATES)
        + " verdict"
    ]
    for f in made:
        if f.failed:
            continue
        cells = "".join(f"{_percent(f, gate):5.1f}%" for gate in GATES)
        used = f"{100.0 * f.believed / max(f.epochs, 1):.0f}%"
        lines.append(
            f"{_label(f)}{f.inflation:5.1f}{f.numbers_inflation:5.1f}{f.window:5.2f}"
            f"{f.window_asked:6.2f}{used:>5}{cells} {f.verdict.removesuffix('_explained')}"
        )
    return "\n".join(lines)


def _percent(f: Fit, gate: str) -> float:
    """Share of the epochs that could be refused."""
    asked = f.epochs if gate in {"tilt", "heading"} else f.believed
    return 100.0 * f.refused.get(gate, 0) / max(asked, 1)


def whiteness_table(made: Sequence[Fit]) -> str:
    """Median over accelerometers; then each kind of each flight."""
    head = (
        f"{'':16}{'kind':12}{'rows':>6}{'var.':>7}{'lag 1':>7}{'<0.1Hz':>8}{'..1Hz':>7}{'>1Hz':>7}"
    )
    lines = [head]
    for kind in KINDS:
        some = [w for f in made for w in f.white if w.kind == kind]
        if some:
            density = np.array([w.density for w in some])
            cells = [_median(density[:, i]) for i in range(density.shape[1])]
            lines.append(
                f"{'median':16}{kind:12}{sum(w.rows for w in some):6}"
                f"{_median([w.variance for w in some]):7.2f}{_median([w.lag1 for w in some]):7.2f}"
                f"{cells[0]:8.2f}{cells[1]:7.2f}{cells[2]:7.2f}"
            )
    lines += [
        f"{_label(f)}{w.kind:12}{w.rows:6}{w.variance:7.2f}{w.lag1:7.2f}"
        f"{w.density[0]:8.2f}{w.density[1]:7.2f}{w.density[2]:7.2f}"
        for f in made
        for w in f.white
    ]
    return "\n".join(lines)


def _median(values: Sequence[float] | np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    finite = np.array([v for v in values if np.isfinite(v)])
    return float(np.median(finite)) if len(finite) else float("nan")


def show(made: Sequence[Fit]) -> None:
    """Print the tables and the criteria."""
    print("Noise levels (SI; . no more than the floor, - at the lower limit, + at the upper)")
    print(level_table(made))
    print("\nInflation of variance, averaging span (s), refused of what could be")
    print(gate_table(made))
    print("\nWhitened residuals: variance, and density by band, 1 each if the model is right")
    print(whiteness_table(made))
    print()
    for share in run(made):
        print(share)


def main(arguments: list[str] | None = None) -> None:
    """Fit and print."""
    fit_and_show("Noise levels on real flights.", show, arguments)


if __name__ == "__main__":
    main()
