"""Recordings by vehicle: what proves that two are of one vehicle, and which are of one flight.

* A board has a serial number of its own.  Recordings with the same are of one vehicle (a board
  that moves to another frame takes its accelerometers along).
* Device ids and system id are the same on every board of a model: they tell vehicles apart and
  prove nothing alike.  A recording without a serial number is a vehicle of its own, unless a
  person says that each folder is one; then those with equal ids, system and autopilot in a folder
  are one.
* A flight may be recorded twice, on board and on the ground.  Of recordings of one vehicle that
  overlap in time, and of files with the same content, one counts: that with more trusted flight.
  One that does not say when it was flown could be either, and is not put together with others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from onboard.answers.fleet.record import Flown, Record
from onboard.recordings.provenance import OVERLAP_S

BOARD, FOLDER, RECORDING = "board", "folder", "recording"
UNDATED = "it does not say when it was flown: it might be another recording of the same flight"


@dataclass(frozen=True, slots=True)
class Flight:
    """One recording of a vehicle; ``why`` says in words why it is not put together with others."""

    flown: Flown
    record: Record
    why: str = ""

    @property
    def began_unix_s(self) -> float:
        """When it was flown; 0 where it does not say."""
        return self.record.provenance.began_unix_s or 0.0


@dataclass(frozen=True, slots=True)
class Vehicle:
    """Recordings of one vehicle, in the order in which they were flown.

    ``identified_by`` is ``board``, ``folder`` or ``recording``; ``name`` is unique in the fleet.
    """

    name: str
    identified_by: str
    flights: tuple[Flight, ...]

    @property
    def counting(self) -> tuple[Flight, ...]:
        """Those that are put together."""
        return tuple(f for f in self.flights if not f.why)

    @property
    def latest(self) -> Record:
        """The record of the last flight."""
        return self.flights[-1].record

    @property
    def type(self) -> str:
        """What vehicles that are built alike have in common: kind, board, frame."""
        records = [f.record for f in self.flights]
        kind = next((r.vehicle_kind for r in reversed(records) if r.vehicle_kind), "vehicle")
        model = next((r.provenance.model for r in reversed(records) if r.provenance.model), "")
        frames = [r.provenance.frame for r in reversed(records)]
        frame = next((f"frame class {f}" for f in frames if f is not None), "")
        return " ".join(x for x in (kind, model, frame) if x)


def vehicles_of(flown: Sequence[Flown], *, by_folder: bool = False) -> tuple[Vehicle, ...]:
    """Recordings that could be read, by vehicle, in the order of the first of each.

    Args:
        flown: in order.
        by_folder: a person says that each folder holds recordings of one vehicle.
    """
    groups: dict[tuple[object, ...], list[tuple[Flown, Record]]] = {}
    for one in flown:
        if one.record is not None:
            key = _key(one.path, one.record, by_folder=by_folder)
            groups.setdefault(key, []).append((one, one.record))
    first = _first_of_content(flown)
    names = _names(groups)
    return tuple(
        Vehicle(names[key], str(key[0]), tuple(_flights(group, first)))
        for key, group in groups.items()
    )


def _key(path: Path, record: Record, *, by_folder: bool) -> tuple[object, ...]:
    p = record.provenance
    if p.board:
        return BOARD, p.board
    if by_folder:
        ids = tuple(sorted(p.accelerometers.items()))
        return FOLDER, path.parent, record.document.recording.autopilot, p.system, ids
    return RECORDING, path


def _names(
    groups: dict[tuple[object, ...], list[tuple[Flown, Record]]],
) -> dict[tuple[object, ...], str]:
    """Names that people can tell apart."""
    names: dict[tuple[object, ...], str] = {}
    taken: set[str] = set()
    for key, group in groups.items():
        one, record = group[0]
        if key[0] == BOARD:
            wanted = f"{record.provenance.model or 'board'} {record.provenance.board}"
        elif key[0] == FOLDER:
            inside = Path(one.name).parent
            wanted = str(inside) if inside.name else one.path.parent.name
        else:
            wanted = one.name
        name, n = wanted, 2
        while name in taken:
            name, n = f"{wanted} ({n})", n + 1
        taken.add(name)
        names[key] = name
    return names


def _first_of_content(flown: Sequence[Flown]) -> dict[str, Flown]:
    first: dict[str, Flown] = {}
    for one in flown:
        if one.record is not None:
            first.setdefault(one.record.sha256, one)
    return first


def _flights(group: Sequence[tuple[Flown, Record]], first: dict[str, Flown]) -> Iterator[Flight]:
    """In the order of the flights, those without a date before them."""
    dated = [(o, r) for o, r in group if r.provenance.began_unix_s is not None]
    dated.sort(key=lambda pair: (pair[1].provenance.began_unix_s, pair[0].name))
    undated = [(o, r) for o, r in group if r.provenance.began_unix_s is None]
    alone = len(group) == 1
    kept: list[tuple[Flown, Record]] = []
    # Those with more flight first: what overlaps one of them is the other recording of it.
    for one, record in sorted(dated, key=lambda pair: -pair[1].trusted_s):
        if first[record.sha256] is one and not any(_same(record, other) for _, other in kept):
            kept.append((one, record))
    for one, record in [*undated, *dated]:
        why = "" if alone and first[record.sha256] is one else _why(one, record, first, kept)
        yield Flight(one, record, why)


def _why(
    one: Flown, record: Record, first: dict[str, Flown], kept: Sequence[tuple[Flown, Record]]
) -> str:
    if first[record.sha256] is not one:
        return f"the same content as {first[record.sha256].name}"
    if record.provenance.began_unix_s is None:
        return UNDATED
    if any(record is other for _, other in kept):
        return ""
    other = next(other for other, its in kept if _same(record, its))
    return f"flown at the same time as {other.name}: another recording of that flight"


def _same(a: Record, b: Record) -> bool:
    """Whether two recordings with dates overlap."""
    p, q = a.provenance, b.provenance
    if None in (p.began_unix_s, p.ended_unix_s, q.began_unix_s, q.ended_unix_s):
        return False
    begin = max(p.began_unix_s or 0.0, q.began_unix_s or 0.0)
    return min(p.ended_unix_s or 0.0, q.ended_unix_s or 0.0) - begin > OVERLAP_S
