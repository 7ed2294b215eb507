"""How what was said is held against what was concealed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.challenge import Measured, named
from benchmarks.matching.adapter import Said
from benchmarks.matching.concealing import Secret


@dataclass(frozen=True, slots=True)
class Outcome:
    """One recording's answer and what was said; ``failure`` where nothing was."""

    secret: Secret
    seal: str
    truth: dict[str, Any]
    said: Said | None
    measured: tuple[Measured, ...] = ()
    seconds: tuple[float, float] = (0.0, 0.0)
    failure: str = ""
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def wanted(self) -> set[str]:
        """Names that should be said."""
        return set(self.secret.wanted)

    @property
    def found(self) -> set[str]:
        """Catalogue names that were said; a formula without a name claims none."""
        return set() if self.said is None else set(self.said.values) - {"empirical"}

    @property
    def identified(self) -> bool:
        """Every concealed effect is named."""
        return self.said is not None and self.secret.wanted <= self.found

    @property
    def overlooked(self) -> bool:
        """Something without a name is concealed, and the recording was called clean."""
        return self.secret.kind == "outside" and self.said is not None and self.said.clean

    @property
    def false(self) -> set[str]:
        """Names that were said of nothing; six numbers of the sensors are no false name."""
        return self.found - self.secret.allowed - {"accelerometer_offset", "accelerometer_scale"}


def measured(truth: dict[str, Any], answer: Said) -> tuple[Measured, ...]:
    """Every unknown of every effect that is both concealed and named."""
    out = []
    for name, unknowns in truth.items():
        told = answer.values.get(name, {})
        for key, true in unknowns.items():
            if key not in told:
                continue
            # A component of a vector near zero is as good as the vector.
            vector = name in ("wind", "thrust_tilt", "mount_tilt")
            size = float(np.linalg.norm(list(unknowns.values()))) if vector else abs(true)
            value, sigma = told[key]
            out.append(Measured(f"{name}.{key}", float(true), value, sigma, size))
    return tuple(out)


HEAD = (
    f"| {'concealed':24} | recordings | small    | large    | false | unknowns | covered "
    "| median | lateral force     |"
)
LEGEND = """\
small, large: how many of them are said by all their names; small ones need not be found.  false:
recordings of which something else is said as well.  unknowns: within 10 % or 3 sigma.  covered:
truth within 1.96 sigma.  median: relative error.  lateral force: median error on flight that was
not used, before and after, m/s^2."""


def _row(label: str, outcomes: Sequence[Outcome]) -> str:
    sized = [
        named([o for o in outcomes if o.secret.level == level]) for level in ("small", "large")
    ]
    values = [m for o in outcomes for m in o.measured if o.secret.testable]
    honest = [m for m in values if np.isfinite(m.sigma)]
    errors = [abs(m.value - m.truth) / m.size for m in values if m.size > 0.0]
    forces = [o.said.held_out for o in outcomes if o.said and np.all(np.isfinite(o.said.held_out))]
    before, after = np.median(np.array(forces), axis=0) if forces else (np.nan, np.nan)
    cells = [
        f"{label:24}",
        f"{len(outcomes):10}",
        *(f"{x:8}" for x in sized),
        f"{sum(bool(o.false) for o in outcomes):5}",
        f"{100 * np.mean([m.right for m in values]):6.0f} %" if values else " " * 8,
        f"{100 * np.mean([m.covered for m in honest]):5.0f} %" if honest else " " * 7,
        f"{100 * np.median(errors):4.1f} %" if errors else " " * 6,
        f"{before:7.3f} -> {after:6.3f}" if forces else " " * 17,
    ]
    return f"| {' | '.join(cells)} |"


def table(outcomes: Sequence[Outcome]) -> str:
    """What the challenge has shown."""
    lines = [HEAD, "|" + "---|" * (HEAD.count("|") - 1)]
    singles = [o for o in outcomes if o.secret.kind == "single"]
    for vehicle in ("copter", "plane"):
        of_it = [o for o in singles if o.secret.vehicle == vehicle]
        lines += [
            _row(f"{vehicle}: {name}", [o for o in of_it if o.secret.names[0] == name])
            for name in sorted({o.secret.names[0] for o in of_it})
        ]
    groups = {
        "all that are testable": [o for o in singles if o.secret.testable],
        "pairs": [o for o in outcomes if o.secret.kind == "pair"],
        "vehicle and sensor": [o for o in outcomes if o.secret.kind == "mixed"],
        "outside the catalogue": [o for o in outcomes if o.secret.kind == "outside"],
        "nothing": [o for o in outcomes if o.secret.kind == "control"],
    }
    lines += [_row(label, some) for label, some in groups.items() if some]
    overlooked = sum(o.overlooked for o in outcomes)
    if overlooked:
        lines.append(f"{overlooked} of those outside the catalogue were called clean")
    failed = sum(o.said is None for o in outcomes)
    if failed:
        lines.append(f"of {failed} recordings nothing was said: the command failed")
    return "\n".join(lines)


def describe(o: Outcome) -> str:
    """One recording's answer beside what was said."""
    values = o.said.values if o.said else {}
    told = {n: {k: f"{v:.4g}±{s:.2g}" for k, (v, s) in q.items()} for n, q in values.items()}
    return (
        f"  seed {o.secret.seed} {o.secret.vehicle} {o.secret.kind} {o.secret.level} "
        f"{'+'.join(o.secret.names) or 'nothing'}: truth {o.truth}, "
        f"said {o.said.verdict if o.said else o.failure} {told}"
    )
