"""Which real flights are for building, which for choosing, which for judging: decided once.

A number that was tuned on a flight says nothing when it is measured on that flight again.  So:

building
    Look as often as wanted, plot, debug.
choosing
    Thresholds, priors and variants of a model are compared here.  Every comparison uses up a little
    of it, so each is entered in :data:`LOOKS`.
judging
    Looked at once for a release, after everything is decided; entered in :data:`JUDGED`.

No vehicle is in two parts, for vibration, mount, receiver and calibration are the vehicle's.  The
one exception is the ``quiver``, of which there are twelve flights, split by flight: what is asked
of it is whether its flights repeat and predict each other, which takes several flights of one
vehicle in each part, and no truth about it is known that could be tuned to.  The two of its flights
that had been looked at before the split, and six vehicles of which the same is true, are for
building.
"""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

Part = Literal["building", "choosing", "judging"]
PARTS: tuple[Part, ...] = get_args(Part)
SPLIT_BY_FLIGHT = frozenset({"quiver"})
"""Vehicles that are in more than one part: see above."""
WHERE = "no real flights beside the project; set ONBOARD_RECORDINGS"


@dataclass(frozen=True, slots=True)
class RealFlight:
    """One recording of a real flight.

    Attributes:
        file: path under the folder of recordings.
        vehicle: the same word for recordings of the same vehicle.
        part: what it may be used for.
        imus: accelerometers that it has with a gyroscope each.
        why: what it is good for, or why it is where it is.
        ends_s: boot clock from which on it is no flight any more: a crash.
    """

    file: str
    vehicle: str
    part: Part
    imus: tuple[int, ...]
    why: str
    ends_s: float = math.inf

    @property
    def name(self) -> str:
        """Of the file, without its ending."""
        return Path(self.file).stem

    @property
    def path(self) -> Path:
        """Where it should be."""
        return folder() / self.file


FLIGHTS = (
    RealFlight("quiver/quiver-00077.BIN", "quiver", "building", (1, 2, 3), "repeats"),
    RealFlight("quiver/quiver-00083.BIN", "quiver", "building", (1, 2, 3), "repeats"),
    RealFlight("quiver/quiver-00087.BIN", "quiver", "building", (1, 2, 3), "repeats"),
    RealFlight("quiver/quiver-00088.BIN", "quiver", "building", (1, 2, 3), "repeats"),
    RealFlight("quiver/quiver-00090.BIN", "quiver", "building", (1, 2, 3), "looked at before"),
    RealFlight("quiver/quiver-00130.BIN", "quiver", "building", (1, 2, 3), "looked at before"),
    RealFlight("real/real-fixedwing-03.BIN", "small wing", "building", (1,), "looked at before"),
    RealFlight("real/real-quad-08.BIN", "Pixhawk quad", "building", (1, 2), "looked at before"),
    RealFlight("real/real-quad-10-hover.BIN", "Pixhawk quad", "building", (1, 2), "as quad-08"),
    RealFlight(
        "real/real-quad-14-crash.BIN", "crashed quad", "building", (1, 2), "looked at", 370.0
    ),
    RealFlight("real/real-quad-22-chibios.BIN", "ChibiOS quad", "building", (1, 2), "looked at"),
    RealFlight("quiver/quiver-00096.BIN", "quiver", "choosing", (1, 2, 3), "repeats"),
    RealFlight("quiver/quiver-00102.BIN", "quiver", "choosing", (1, 2, 3), "repeats"),
    RealFlight("quiver/quiver-00108.BIN", "quiver", "choosing", (1, 2, 3), "repeats"),
    RealFlight(
        "real/real-fixedwing-02.BIN", "research wing", "choosing", (1,), "1 Hz GPS, a plane"
    ),
    RealFlight("real/real-quad-12-gpsglitch.BIN", "glitch quad", "choosing", (1,), "gates"),
    RealFlight("real/real-px4-hex-23.ulg", "PX4 hexacopter", "choosing", (1,), "PX4"),
    RealFlight("quiver/quiver-00111.BIN", "quiver", "judging", (1, 2, 3), "repeats"),
    RealFlight("quiver/quiver-00112.BIN", "quiver", "judging", (1, 2, 3), "repeats"),
    RealFlight("quiver/quiver-00117.BIN", "quiver", "judging", (1, 2, 3), "repeats"),
    RealFlight("real/real-quad-07.BIN", "slow quad", "judging", (1,), "14 min, all headings"),
    RealFlight("real/real-quad-16-gaps.BIN", "gappy quad", "judging", (1, 2, 3), "gaps, new log"),
    RealFlight("real/real-ground-18.BIN", "carried board", "judging", (1, 2), "must say nothing"),
)
"""All of them.  A flight never moves from choosing or judging to another part."""

LOOKS: tuple[str, ...] = (
    "lower ends of noise levels: as they were, or those of data sheets",
    "the search for noise levels: a stencil a factor of two wide, or Fisher's scoring",
    "headings set anew put right, and force noise by the samples' restlessness, or neither",
    "the receiver's response a mixture of shapes, spans to 1.2 s, no touch-downs, or as it was",
    "attitudes that follow the gyroscope, no rolling, noise as the velocity walks, or as it was",
    "the receiver's shapes in the linearisation, jumps where half of the best is, or as it was",
    "a heading that is set anew not followed, time and walk of its error found, or as it was",
    "an EKF followed along the flight, its own sensors and antenna unknowns of it, or a loop",
    "what surely improves is a calibration, after 30 s and of hovers too, or as it was",
    "what a receiver states of its accuracy weighs, or a gate at 1.5 m/s",
    "offsets of two accelerometers surely wander apart, or as likely as not",
    "a receiver's errors where its velocity jumps, or where gates refuse it for a while",
)
"""Comparisons that were made on the choosing flights, one line each, in order."""
JUDGED: tuple[str, ...] = (
    "2026-11-23",
    "2026-11-23-2",
    "2026-11-23-3",
    "2026-11-23-4",
    "2026-11-23-5",
    "2026-11-24",
    "2026-11-24-2",
    "2026-11-25",
    "2026-11-25-2",
    "2026-11-25-3",
    "2026-11-26",
    "2026-11-26-2",
    "2026-11-27",
    "2026-11-27-2",
    "2026-11-30",
)
"""Releases that have been judged."""


def folder() -> Path:
    """Where the recordings are: ONBOARD_RECORDINGS, or beside the project."""
    beside = Path(__file__).resolve().parents[2] / ".." / "shared" / "recordings"
    return Path(os.environ.get("ONBOARD_RECORDINGS", beside))


def available(part: Part, names: Sequence[str] = ()) -> list[RealFlight]:
    """Flights of a part that are on this machine, those that are named or all.

    Raises:
        ValueError: a name is not of this part.
    """
    of_part = {f.name: f for f in FLIGHTS if f.part == part}
    by_name = {f.name: f for f in FLIGHTS}
    for name in names:
        if name not in of_part:
            whose = f"it is for {by_name[name].part}" if name in by_name else "there is none"
            raise ValueError(f"{name} is not for {part}: {whose}")
    wanted = [of_part[n] for n in names] or list(of_part.values())
    return [f for f in wanted if f.path.is_file()]


def table() -> str:
    """The split, for a person."""
    lines = [f"{'flight':24}{'vehicle':16}{'part':10}{'IMUs':>5}  why"]
    lines += [f"{f.name:24}{f.vehicle:16}{f.part:10}{len(f.imus):5}  {f.why}" for f in FLIGHTS]
    count = {part: sum(f.part == part for f in FLIGHTS) for part in PARTS}
    lines.append(", ".join(f"{n} for {part}" for part, n in count.items()))
    lines.append(f"looks at the choosing flights: {len(LOOKS)}; releases judged: {len(JUDGED)}")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> None:
    """Print the split."""
    argparse.ArgumentParser(description="The split of the real flights.").parse_args(arguments)
    print(table())


if __name__ == "__main__":
    main()
