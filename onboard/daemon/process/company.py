"""Whether two autopilots answer to one name: each hears what is written to the other.

Boards that tell their unique ids are told apart by these (:mod:`onboard.mavlink.board`).  Of others
the boot clocks go on beside each other (:mod:`onboard.mavlink.otherclock`), or, where both were
switched on together, values of parameters go back and forth (:mod:`onboard.mavlink.twofold`).
"""

from __future__ import annotations

from onboard.daemon.pushing.parameters import ParameterWatch
from onboard.mavlink.board import Board
from onboard.mavlink.link import Link


class Company:
    """Asks those that notice it; ``now`` is a monotonic clock, s."""

    def __init__(self, link: Link, board: Board, parameters: ParameterWatch) -> None:
        self._link = link
        self._board = board
        self._parameters = parameters

    def are_two(self, now: float) -> bool:
        """Whether two have answered as one of late."""
        return (
            self._board.are_two(now)
            or self._link.boot_clock.other.goes_on(now)
            or self._parameters.twofold.goes_on(now)
        )
