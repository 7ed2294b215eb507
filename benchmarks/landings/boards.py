"""Boards of one model: same device ids, but each has sensors and stored parameters of its own."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

from sitl.builtin.params import as_float32
from sitl.builtin.truth import ImuTruth, random_imus

AXES = "XYZ"
FACTORY_OFFSET = 0.001
"""As the built-in autopilot has it: ArduPilot does not arm with three offsets of zero."""
BENCH_SCALE, BENCH_OFFSET = 5e-4, 0.01
"""Standard deviations of a calibration by hand: six positions to a degree or so, m/s^2."""


def names(imu: int) -> tuple[str, ...]:
    """The six parameters of accelerometer ``imu`` (from 1): scales, then offsets."""
    stem = f"INS_ACC{imu if imu > 1 else ''}"
    return tuple(f"{stem}{what}_{axis}" for what in ("SCAL", "OFFS") for axis in AXES)


@dataclass(slots=True, eq=False)
class Board:
    """One board; ``stored`` is what it had in its parameters when it was last taken out."""

    name: str
    uid: str
    imus: tuple[ImuTruth, ...]
    stored: dict[str, float] = field(default_factory=dict)

    def truth(self) -> dict[str, float]:
        """The six of every accelerometer that would be right, by name."""
        return {
            name: value
            for number, imu in enumerate(self.imus, start=1)
            for name, value in zip(names(number), imu.scale + imu.offset, strict=True)
        }

    def bench_calibration(self, rng: random.Random) -> dict[str, float]:
        """What somebody gets who calibrates it by hand: right, but for that person's errors."""
        return {
            name: as_float32(
                value + rng.gauss(0.0, BENCH_SCALE if "SCAL" in name else BENCH_OFFSET)
            )
            for name, value in self.truth().items()
        }


def draw_boards(
    rng: random.Random, count: int, imus: int, *, telling: bool = True
) -> tuple[Board, ...]:
    """Boards of one model; every other one has been calibrated on a bench.

    Args:
        rng: chance.
        count: how many.
        imus: accelerometers of the model.
        telling: whether the firmware tells a unique id.
    """
    boards = []
    for number in range(count):
        uid = f"{rng.getrandbits(96):024x}".ljust(36, "0") if telling else ""
        board = Board("ABCDEFGH"[number], uid, random_imus(rng.randrange(10**6), imus))
        if number % 2:
            board.stored = board.bench_calibration(rng)
        else:
            board.stored = {
                name: 1.0 if "SCAL" in name else FACTORY_OFFSET for name in board.truth()
            }
        boards.append(board)
    return tuple(boards)
