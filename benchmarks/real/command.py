"""The command line of a part that looks at the real flights for building."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence

from benchmarks.real.flights import Fit, fits
from benchmarks.real.split import WHERE, RealFlight, available


def building(
    parser: argparse.ArgumentParser,
    arguments: list[str] | None,
    usable: Callable[[Sequence[RealFlight]], list[RealFlight]] = list,
) -> tuple[argparse.Namespace, list[RealFlight]]:
    """What is asked for, and the flights; where there is none, it is said why.

    Args:
        parser: with the part's own options.
        arguments: those of the process if None.
        usable: which of the flights the part can use.
    """
    parser.add_argument("--flights", nargs="*", default=[], help="of those for building")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    chosen = parser.parse_args(arguments)
    flights = usable(available("building", chosen.flights))
    if not flights:
        print(WHERE)
    return chosen, flights


def fit_and_show(
    description: str,
    show: Callable[[Sequence[Fit]], None],
    arguments: list[str] | None,
    usable: Callable[[Sequence[RealFlight]], list[RealFlight]] = list,
) -> None:
    """Fit every accelerometer of the flights, and print what ``show`` makes of them."""
    chosen, flights = building(argparse.ArgumentParser(description=description), arguments, usable)
    if flights:
        show(fits(flights, chosen.jobs))
