"""The shelf: what was learned of each board and the flight that was judged last, on the disk."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable

from onboard import __version__
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.saving import SavedEngine, dump
from onboard.daemon.learning.flight import JudgedFlight, decode, encode
from onboard.daemon.learning.identity import Identity
from onboard.daemon.learning.store import Store
from onboard.errors import StateError


class Shelf:
    """A store whose places belong to boards.

    Args:
        store: the disk.
    """

    def __init__(self, store: Store) -> None:
        self.counters: Counter[str] = Counter()
        self.lost_s = 0.0
        """Seconds that were flown before what was loaded was saved, and are not in it."""
        self._store = store

    def load(self, whose: Identity, calibrator: Calibrator) -> JudgedFlight | None:
        """Lay a board's sums beside this calibrator; the last flight of it that was judged.

        Raises:
            StateError: what is there is damaged, or of another version.
        """
        self.lost_s = 0.0
        try:
            saved = self._store.load(whose.system_id, whose.board)
            if saved is None:
                return None
        except StateError:
            self.counters["state_refused"] += 1
            raise
        try:
            calibrator.lay_aside(saved.sums)
        except StateError as error:
            self.counters["state_refused"] += 1
            aside = self._store.set_aside(whose.system_id, whose.board)
            raise StateError(f"{error}, set aside as {aside}") from None
        self.counters["state_resumed"] += 1
        self.lost_s = saved.unjudged_s if math.isfinite(saved.unjudged_s) else 0.0
        return decode(saved.flight) if saved.flight else None

    def save(
        self,
        whose: Identity,
        sums: Iterable[SavedEngine],
        flight: JudgedFlight | None,
        saved_at: float,
        *,
        unjudged_s: float,
    ) -> None:
        """Write a board's sums and its last flight, and how much was flown that is in neither.

        Raises:
            StateError: the disk does not take them.
        """
        self._store.save(
            whose.system_id,
            dump(sums),
            version=__version__,
            saved_at=saved_at,
            board=whose.board,
            flight=b"" if flight is None else encode(flight),
            unjudged_s=unjudged_s,
        )
        self.counters["saves"] += 1

    def clear(self, whose: Identity) -> None:
        """Forget what was learned of this board, also where it did not tell which it is.

        Raises:
            StateError: the disk keeps it.
        """
        for board in dict.fromkeys((whose.board, "")):
            self._store.forget(whose.system_id, board)
