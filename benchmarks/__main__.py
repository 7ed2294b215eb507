"""``make bench``: every benchmark in one run, side by side.

``python -m benchmarks --only accuracy cost`` runs some of them; each is a module of its own too.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

from benchmarks import (
    accuracy,
    against,
    cost,
    coverage,
    cramer_rao,
    daemon,
    ekf_bias,
    error_state,
    explain_time,
    explaining,
    frames,
    lag,
    link,
    reading,
    robustness,
)
from benchmarks.matching import runner as matching
from benchmarks.real import runner as real
from onboard.core.maths.compiling import prefer_compiled


def _paths() -> None:
    for name, value, unit in (*link.run(), *daemon.run()):
        print(f"{name:50} {value:10.3g} {unit}")


def main() -> None:
    """Run what is asked for; all of it by default."""
    parser = argparse.ArgumentParser(prog="benchmarks", description=__doc__)
    parser.add_argument("--flights", type=int, default=20, help="simulated flights for coverage")
    parser.add_argument("--matched", type=int, default=50, help="matched flights of each vehicle")
    parser.add_argument("--recordings", type=int, default=40, help="concealed-effect recordings")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these parts alone")
    chosen = parser.parse_args()
    parts: dict[str, tuple[str, Callable[[], None]]] = {
        "accuracy": ("Accuracy on recordings with known answers", lambda: accuracy.main([])),
        "cramer_rao": (
            "RMS error over the Cramer-Rao bound",
            lambda: cramer_rao.main(["--count", str(chosen.matched)]),
        ),
        "coverage": (
            "Honesty of the sigmas on simulated flights",
            lambda: coverage.main(["--count", str(chosen.flights)]),
        ),
        "robustness": ("Faults of the GPS receiver", lambda: robustness.main([])),
        "error_state": ("Against an error-state filter", lambda: error_state.main([])),
        "ekf_bias": ("Against the autopilot's own bias", lambda: ekf_bias.main([])),
        "lag": ("Latency, against the usual method", lambda: lag.main([])),
        "explaining": (
            "Concealed effects, sealed answers",
            lambda: explaining.main(["--count", str(chosen.recordings)]),
        ),
        "frames": ("Airframes and winds of ArduPilot's simulator", lambda: frames.main([])),
        "matching": (
            "Concealed airframes, sealed answers",
            lambda: matching.main(["--count", str(chosen.recordings)]),
        ),
        "explain_time": ("Time of an explanation", lambda: explain_time.main([])),
        "against": (
            "Cost and answers, against earlier code",
            lambda: against.main(["--pairs", "3"]),
        ),
        "real": ("Real flights, which nobody knows the truth about", lambda: real.main([])),
        "reading": ("Reading recordings, against other readers", lambda: reading.main([])),
        "cost": ("Cost of the estimator", lambda: cost.main([])),
        "paths": ("Cost of link and service", _paths),
    }
    wanted = chosen.only or list(parts)
    unknown = sorted(set(wanted) - set(parts))
    if unknown:
        parser.error(f"no part {', '.join(unknown)}; there are {', '.join(parts)}")
    for name in wanted:
        title, run = parts[name]
        print(f"\n## {title}", flush=True)
        prefer_compiled(yes=name != "cost")  # the service, whose cost it is, runs without
        run()


if __name__ == "__main__":
    main()
