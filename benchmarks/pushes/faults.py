"""What goes wrong in one history: drawn from a seed, told in words."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

TURBULENCE_S = 14.0
"""s in which things go wrong; then they go right, and what is left open has to be closed."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that happens at a time (s), for ``duration`` where it lasts."""

    at: float
    kind: str
    duration: float = 0.0
    name: int = 0
    value: float = 0.0

    def __str__(self) -> str:
        return f"{self.at:8.3f} s  {self.kind} ({self.duration:.2f} s, {self.name}, {self.value:g})"


@dataclass(frozen=True, slots=True)
class Weather:
    """What the link does to packets, each way: shares, and delays in s."""

    loss: float
    duplication: float
    late: float
    latest: float


@dataclass(frozen=True, slots=True)
class Script:
    """All of one history."""

    seed: int
    weather: Weather
    faults: tuple[Fault, ...]
    in_flight: bool
    wrong_echo: float
    quantum: float
    store_delay: float
    deaths: tuple[int, ...]
    disk_deaths: tuple[int, ...]
    offsets: tuple[tuple[float, ...], tuple[float, ...]]
    lines: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        calm = f"seed {self.seed}: {self.weather}, in flight {self.in_flight}"
        more = f"wrong echo {self.wrong_echo}, quantum {self.quantum}, stores in {self.store_delay}"
        ends = f"dies at steps {self.deaths}, at disk operations {self.disk_deaths}"
        return "\n".join((calm, more, ends, *map(str, self.faults)))


KINDS = ("arm", "arm_says_so", "cut", "silence", "reboot", "quiet_reboot", "deny", "full_disk",
         "full_storage", "rival_sets", "rival_restores", "rival_reads", "fly",
         "held_back")  # fmt: skip
OFFSETS = (
    ((0.02, -0.03, 0.04), (0.15, -0.21, 0.08)),
    ((0.1, 0.0, 0.0), (0.0, 0.2, 0.0)),
    ((0.0, 0.0, 0.3), (0.0, 0.1, 0.0)),
    ((0.1, 0.2, 0.3), (0.1, 0.2, 0.3)),
)


def draw(seed: int) -> Script:
    """The script of a seed; half of them have one fault, so that it meets every moment."""
    rng = random.Random(seed)  # noqa: S311 - chance, no secret
    calm = rng.random() < 0.4
    weather = Weather(
        loss=0.0 if calm else rng.choice((0.0, 0.05, 0.2, 0.4)),
        duplication=0.0 if calm else rng.choice((0.0, 0.1, 0.3)),
        late=0.0 if calm else rng.choice((0.0, 0.1, 0.3)),
        latest=rng.choice((0.2, 1.0, 1.8)),
    )
    count = rng.choice((0, 1, 1, 1, 2, 3, 5))
    faults = tuple(
        sorted(
            (
                Fault(
                    at=rng.uniform(0.0, rng.choice((3.0, 4.5, TURBULENCE_S))),
                    kind=rng.choice(KINDS),
                    duration=rng.choice((0.1, 0.5, 1.5, 4.0, 8.0)),
                    name=rng.randrange(6),
                    value=rng.choice((0.0, 0.5, 1.0)),
                )
                for _ in range(count)
            ),
            key=lambda fault: fault.at,
        )
    )
    return Script(
        seed=seed,
        weather=weather,
        faults=faults,
        in_flight=rng.random() < 0.15,
        wrong_echo=rng.choice((0.0, 0.0, 0.0, 0.03)),
        quantum=rng.choice((0.0, 0.0, 0.0, 0.0, 1e-4, 1e-6)),
        store_delay=rng.choice((0.02, 0.02, 0.4)),
        deaths=tuple(rng.randrange(90) for _ in range(rng.choice((0, 0, 1, 1, 2, 3)))),
        disk_deaths=tuple(rng.randrange(1, 50) for _ in range(rng.choice((0, 0, 0, 1, 2)))),
        offsets=rng.choice(OFFSETS),
    )
