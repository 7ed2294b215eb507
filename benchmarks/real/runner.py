"""All parts in one run, side by side, for a person and as JSON to compare before and after.

Each accelerometer is estimated once, for all parts but the concealed errors.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.real import conceal, levels, offered, outcomes, pair_parts, pairs, repeats, rest
from benchmarks.real.flights import Fit, fits
from benchmarks.real.pairs import Agreement, Pair
from benchmarks.real.split import (
    JUDGED,
    LOOKS,
    WHERE,
    Part,
    RealFlight,
    available,
    table,
)

SCHEMA = "onboard.benchmarks.real/1"
CONTENTS = ("levels", "offered", "rest", "pairs", "repeats", "conceal")
BULKY = ("chain", "states")
"""Of a fit, what is no result."""


@dataclass(frozen=True, slots=True)
class Results:
    """Everything that was measured; a part that was not asked for is empty."""

    part: Part
    made: tuple[Fit, ...] = ()
    shares: tuple[levels.Share, ...] = ()
    elsewhere: tuple[offered.Elsewhere, ...] = ()
    apart: tuple[offered.Apart, ...] = ()
    rests: tuple[rest.Rest, ...] = ()
    pairs: tuple[Pair, ...] = ()
    agreements: tuple[Agreement, ...] = ()
    in_parts: tuple[pair_parts.PairInParts, ...] = ()
    scatter: tuple[repeats.Scatter, ...] = ()
    together: tuple[repeats.Together, ...] = ()
    left_out: tuple[repeats.LeftOut, ...] = ()
    concealed: tuple[outcomes.Outcome, ...] = ()

    def document(self) -> dict[str, Any]:
        """As JSON: no NaN, arrays as lists."""
        return {
            "schema": SCHEMA,
            "part": self.part,
            "fits": [
                _json(f) | {"at_limit": list(f.at_limit), "clipped": f.clipped} for f in self.made
            ],
            "criteria": _json(self.shares),
            "offered": {"elsewhere": _json(self.elsewhere), "apart": _json(self.apart)},
            "rest": [_json(r) | {"off": r.off} for r in self.rests],
            "pairs": [_json(p) | {"chi_square": p.chi_square} for p in self.pairs],
            "agreements": _json(self.agreements),
            "pairs_in_parts": _json(self.in_parts),
            "repeats": {
                "scatter": _json(self.scatter),
                "together": _json(self.together),
                "left_out": _json(self.left_out),
            },
            "concealed": [_json(o) | {"recovered": o.recovered} for o in self.concealed],
        }


def _json(value: Any) -> Any:  # noqa: ANN401 - whatever a record holds
    if is_dataclass(value):
        return {f.name: _json(getattr(value, f.name)) for f in fields(value) if f.name not in BULKY}
    match value:
        case np.ndarray() | np.generic():
            return _json(value.tolist())
        case dict():
            return {str(k): _json(v) for k, v in value.items()}
        case list() | tuple():
            return [_json(v) for v in value]
        case float() if not math.isfinite(value):
            return None
        case Enum():
            return value.value
        case _:
            return value


def run(
    part: Part,
    flights: Sequence[RealFlight],
    contents: Sequence[str] = CONTENTS,
    *,
    kinds: Sequence[str] = (),
    limit: int = 15,
    jobs: int = 1,
) -> Results:
    """Measure what is asked for.

    Args:
        part: of the split that the flights are of.
        flights: recordings.
        contents: some of :data:`CONTENTS`.
        kinds: words of the names of concealed errors; none: all.
        limit: of concealed errors; 0: all.
        jobs: processes.
    """
    made: tuple[Fit, ...] = ()
    if set(contents) - {"conceal"}:
        made = tuple(fits(flights, jobs))
    scatter, left_out = repeats.run(made) if "repeats" in contents else ([], [])
    concealed: list[outcomes.Outcome] = []
    if "conceal" in contents:
        some = conceal.chosen_kinds(kinds)
        concealed = conceal.run(flights, some, limit=limit, jobs=jobs)
    return Results(
        part,
        made,
        tuple(levels.run(made)) if "levels" in contents else (),
        tuple(offered.elsewhere(made)) if "offered" in contents else (),
        tuple(offered.apart(made)) if "offered" in contents else (),
        tuple(rest.run(made)) if "rest" in contents else (),
        tuple(pairs.run(made)) if "pairs" in contents else (),
        tuple(pairs.agreements(made)) if "pairs" in contents else (),
        tuple(pair_parts.run(made)) if "pairs" in contents else (),
        tuple(scatter),
        tuple(repeats.together(made)) if "repeats" in contents else (),
        tuple(left_out),
        tuple(concealed),
    )


def show(found: Results, contents: Sequence[str]) -> None:
    """Print every table."""
    if "levels" in contents:
        print("\n### Levels")
        levels.show(found.made)
    if "offered" in contents:
        print("\n### Offered to be set")
        print(offered.table(found.made))
        print("\n".join(offered.summary(found.made, found.elsewhere, found.apart)))
    if "rest" in contents:
        print("\n### At rest, more than gravity, m/s^2")
        print(rest.table(found.rests))
    if "pairs" in contents:
        print("\n### Pairs of accelerometers in flight, m/s^2")
        print(pairs.table(found.pairs, found.agreements))
        print()
        print(pairs.own_table(found.pairs))
        print()
        print(pair_parts.table(found.in_parts))
    if "repeats" in contents:
        print("\n### Repeated flights")
        print(repeats.scatter_table(found.scatter))
        print()
        print(repeats.left_out_table(found.left_out))
        print("\n".join(repeats.summary(found.scatter, found.together, found.left_out)))
    if "conceal" in contents:
        print("\n### Concealed errors")
        print(outcomes.table(found.concealed))
        print(outcomes.LEGEND)


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="benchmarks.real", description=__doc__)
    parser.add_argument("--parts", nargs="+", choices=CONTENTS, default=list(CONTENTS))
    parser.add_argument("--flights", nargs="*", default=[], help="names; all of the part if none")
    parser.add_argument("--kinds", nargs="*", default=[], help="words of concealed errors' names")
    parser.add_argument("--limit", type=int, default=15, help="so many concealed errors; 0: all")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--json", type=Path, metavar="FILE", help="keep the numbers here")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--choose", metavar="WHY", help="use the flights for choosing")
    which.add_argument("--judge", metavar="RELEASE", help="use the flights for judging")
    which.add_argument("--split", action="store_true", help="print the split and no more")
    chosen = parser.parse_args(arguments)
    if chosen.split:
        print(table())
        return
    part: Part = "choosing" if chosen.choose else "judging" if chosen.judge else "building"
    if chosen.judge in JUDGED:
        parser.error(f"{chosen.judge} has been judged: once for a release")
    try:
        conceal.chosen_kinds(chosen.kinds)
        flights = available(part, chosen.flights)
    except ValueError as error:
        parser.error(str(error))
    if not flights:
        print(WHERE)
        return
    if chosen.choose:
        print(f"look {len(LOOKS) + 1} at the choosing flights: enter {chosen.choose!r} in LOOKS")
    if chosen.judge:
        print(f"judging {chosen.judge}: enter it in JUDGED")
    found = run(
        part, flights, chosen.parts, kinds=chosen.kinds, limit=chosen.limit, jobs=chosen.jobs
    )
    show(found, chosen.parts)
    if chosen.json:
        chosen.json.write_text(json.dumps(found.document(), indent=1, allow_nan=False))


if __name__ == "__main__":
    main()
