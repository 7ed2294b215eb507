"""How the estimates converged: a bounded memory for charts, across reloads and restarts.

One row an accelerometer for a while of trusted flight: the six numbers, their sigmas, and the
parameters in force.  Rows go by trusted time *in the air*: a vehicle that stands for days adds
none, however good its GPS, and what is refined after the landing changes the newest.  A curve
ends when the flight that replaces it begins, or when a person has what was learned forgotten; a
restart ends none, though sums and curves may be of different moments.  The file is for looking at
only: one that is lost or damaged is begun anew.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from onboard.core.inputs.airborne import grounded
from onboard.daemon.view.snapshot import ImuView, Snapshot
from onboard.outage import Outage

if TYPE_CHECKING:
    from aiohttp import web

logger = logging.getLogger(__name__)

SCHEMA = "onboard.history/1"
ROWS_MAX = 300
LARGEST = 4_000_000
"""bytes; rows of five accelerometers have some hundred thousand."""
SAVE_S = 300.0
"""Between two writes to the disk; SD cards wear."""
BOARDS_KEPT = 64
"""Boards whose charts are kept, as many as there are sums of; the oldest give way [cost]."""
BACK_S = 1.0
"""Trusted time that went back by more: the estimates have begun anew."""

Six = tuple[float | None, ...]


class Row(msgspec.Struct, frozen=True, array_like=True):
    """One moment: ``time`` Unix, ``flown_s`` of trusted flight; each six as SIX_NAMES."""

    time: float
    flown_s: float
    value: Six
    sigma: Six
    in_force: Six


class Ring(msgspec.Struct):
    """Rows in a fixed budget.

    When it is full every second row goes, and from then on rows are taken half as often: all the
    time since the beginning stays visible, only coarser.  The newest row is always there.
    ``trusted_s`` is what the accelerometer had last; ``over``: the next flight begins a new curve.
    """

    rows: list[Row] = []
    every: int = 1
    skipped: int = 0
    provisional: bool = False
    trusted_s: float = 0.0
    over: bool = False

    def advance(self, trusted_s: float, *, flying: bool, resumed: bool = False) -> float | None:
        """Where on the axis of trusted flight this moment lies, s; None: before any flight.

        Args:
            trusted_s: of the accelerometer, all that its estimates rest on.
            flying: whether it is in the air.
            resumed: this is the first moment after a restart: sums were saved at another time.
        """
        gained = trusted_s - self.trusted_s
        if gained < -BACK_S:
            self.over = self.over or not resumed
            gained = 0.0 if resumed else trusted_s
        self.trusted_s = trusted_s
        if flying and gained > 0.0:
            if self.over:
                self.clear()
            return (self.rows[-1].flown_s if self.rows else 0.0) + gained
        return self.rows[-1].flown_s if self.rows and not self.over else None

    def clear(self) -> None:
        """Begin a new curve."""
        self.rows, self.every, self.skipped, self.provisional = [], 1, 0, False
        self.over = False

    def add(self, row: Row, limit: int = ROWS_MAX) -> bool:
        """Take a row; False if there is nothing new in it."""
        last = self.rows[-1] if self.rows else None
        if last is not None and row.flown_s <= last.flown_s:
            if (last.value, last.sigma, last.in_force) == (row.value, row.sigma, row.in_force):
                return False
            self.rows[-1] = row
            return True
        if self.provisional:
            self.rows.pop()
        self.rows.append(row)
        self.skipped += 1
        self.provisional = self.skipped < self.every and len(self.rows) > 1
        if not self.provisional:
            self.skipped = 0
            if len(self.rows) >= limit:
                self._thin()
        return True

    def _thin(self) -> None:
        newest = self.rows[-1]
        self.rows = self.rows[::2]
        self.every *= 2
        if self.rows[-1] is not newest:
            self.rows.append(newest)
            self.provisional, self.skipped = True, self.every // 2


class Kept(msgspec.Struct):
    """The file: rings by accelerometer."""

    schema: str = SCHEMA
    imus: dict[int, Ring] = {}


class Columns(msgspec.Struct, frozen=True, kw_only=True):
    """One accelerometer in ``GET /api/history``."""

    imu: int
    rows: list[Row]


class HistoryDocument(msgspec.Struct, frozen=True, kw_only=True):
    """``GET /api/history``; each row is time, flown_s, value, sigma, in_force."""

    imus: list[Columns]
    schema: str = SCHEMA


class History:
    """Takes every snapshot, keeps what is new in it.

    Args:
        directory: where its file lies, one for each board.
        clock: monotonic time, s.
        board: the unique id in hex of the board that the snapshot's estimates are of, empty if it
            tells none, None while nobody knows.
    """

    def __init__(
        self,
        directory: Path,
        *,
        clock: Callable[[], float],
        board: Callable[[], str | None] = lambda: "",
    ) -> None:
        self._directory = directory
        self._clock = clock
        self._board = board
        self._path: Path | None = None
        self._kept = Kept()
        self._resumed: set[int] = set()
        self._flying = False
        self._resets: int | None = None
        self._dirty = False
        self._disk = Outage(settle_s=0.0)
        self._next_save = clock() + SAVE_S

    def take(self, snapshot: Snapshot) -> None:
        """A tick has passed."""
        system_id, board = snapshot.link.system_id, self._board()
        if system_id is None or board is None:
            return  # whose they are is not known yet
        path = self._directory / f"history-{f'board-{board}' if board else system_id}.bin"
        if path != self._path:
            self.save()
            self._path = path
            self._kept = _load(path)
            self._resumed = set(self._kept.imus)
        self._forget(snapshot.counters.get("resets", 0))
        flew, self._flying = self._flying, is_flying(snapshot)
        for view in snapshot.imus:
            ring = self._kept.imus.setdefault(view.imu, Ring())
            resumed = view.imu in self._resumed
            flown_s = ring.advance(view.trusted_s, flying=self._flying, resumed=resumed)
            self._resumed.discard(view.imu)
            if flown_s is not None:
                self._dirty |= ring.add(_row(view, snapshot.time, flown_s))
        landed = flew and not self._flying
        # Often the power goes right after the landing.
        if self._dirty and (landed or self._clock() >= self._next_save):
            self.save()

    def _forget(self, resets: int) -> None:
        """A person has had what was learned forgotten."""
        if self._resets is not None and resets != self._resets:
            self._dirty |= bool(self._kept.imus)
            self._kept.imus.clear()
        self._resets = resets

    def document(self) -> HistoryDocument:
        """Everything, for charts."""
        rings = sorted(self._kept.imus.items())
        return HistoryDocument(imus=[Columns(imu=imu, rows=ring.rows) for imu, ring in rings])

    def save(self) -> None:
        """Put it on the disk, if there is anything new; failing that, go on without."""
        self._next_save = self._clock() + SAVE_S
        if not self._dirty or self._path is None:
            return
        self._dirty = False
        path = self._path
        temporary = path.with_suffix(".new")
        try:
            if not path.exists():
                self._make_room()
            temporary.write_bytes(msgspec.msgpack.encode(self._kept))
            temporary.replace(path)
        except OSError as error:
            why = error.strerror or str(error)
            if self._disk.failed(why, self._clock()):
                logger.warning("%s: %s: charts begin anew after a restart", path, why)
            return
        self._disk.works(self._clock())
        over = self._disk.over(self._clock())
        if over is not None:
            logger.info("%s: charts are kept again, after %s", path, over)

    def page(self, application: web.Application) -> None:
        """Serve it at ``/api/history``."""
        from aiohttp import web  # noqa: PLC0415 - not before somebody looks

        async def history(_request: web.Request) -> web.StreamResponse:
            return web.Response(
                body=msgspec.json.encode(self.document()),
                content_type="application/json",
                headers={"Cache-Control": "no-store"},
            )

        application.router.add_get("/api/history", history)

    def _make_room(self) -> None:
        """One more board: a board is easily made up, and the disk is the journal's too."""
        files = sorted(self._directory.glob("history-*.bin"), key=lambda p: p.stat().st_mtime)
        for path in files[: max(0, len(files) + 1 - BOARDS_KEPT)]:
            path.unlink(missing_ok=True)


def _load(path: Path) -> Kept:
    try:
        if path.stat().st_size > LARGEST:
            return Kept()
        kept = msgspec.msgpack.decode(path.read_bytes(), type=Kept)
    except (OSError, msgspec.DecodeError, ValueError, RecursionError):
        return Kept()
    return kept if kept.schema == SCHEMA else Kept()


def is_flying(snapshot: Snapshot) -> bool:
    """Whether the vehicle is in the air, as far as it says."""
    return not grounded(armed=snapshot.link.armed, landed=snapshot.link.landed)


def _row(view: ImuView, time: float, flown_s: float) -> Row:
    c = view.calibration
    return Row(
        round(time, 1),
        round(flown_s, 2),
        _rounded(c.scale + c.offset),
        _rounded(c.scale_sigma + c.offset_sigma),
        _rounded(view.in_force_scale + view.in_force_offset),
    )


def _rounded(values: Iterable[float | None]) -> Six:
    """Digits that a chart can show."""
    return tuple(None if v is None else round(v, 5) for v in values)
