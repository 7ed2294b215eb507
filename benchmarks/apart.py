"""How far two answers of one command are apart: numbers in their sigmas, names that came or went.

An answer is what ``--json`` writes.  A number has a sigma if one stands beside it: as ``sigma``
beside ``value`` (or ``real``), as ``x_sigma`` or ``sigma_x`` beside ``x``, element by element where
both are lists.  Members of a list that have names, or numbers of accelerometers, are known by
these and not by their place.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

Json = object
Path = tuple[str, ...]
OF_SIGMA = ("value", "real")
"""What ``sigma`` is the sigma of, in the same object."""
KNOWN_BY = ("name", "imu")


@dataclass(frozen=True, slots=True)
class Change:
    """Of one number: where it is, what it was and is, and by how much more, in its sigmas."""

    where: str
    before: float
    now: float
    by: float


@dataclass(frozen=True, slots=True)
class Apart:
    """Two answers of one command.

    Attributes:
        in_sigmas: numbers with a sigma that are others, the largest change first; ``by`` is in the
            sigmas that they had.
        relative: numbers without one that are others, likewise; ``by`` is of the larger of both.
        came: names and keys that only the second answer has.
        went: those that only the first has.
        said: other words than before: (where, before, now).
    """

    in_sigmas: tuple[Change, ...]
    relative: tuple[Change, ...]
    came: tuple[str, ...]
    went: tuple[str, ...]
    said: tuple[tuple[str, str, str], ...]

    @property
    def nothing(self) -> bool:
        """Whether both are the same."""
        return not (self.in_sigmas or self.relative or self.came or self.went or self.said)


def apart(before: Json, now: Json) -> Apart:
    """Compare two answers, as ``json.load`` gives them."""
    first, second = dict(_leaves(before)), dict(_leaves(now))
    in_sigmas, relative, said = [], [], []
    for path, (old, sigma) in first.items():
        if path not in second or old == second[path][0]:
            continue
        new, where = second[path][0], "/".join(path)
        if not (_number(old) and _number(new)):
            said.append((where, str(old), str(new)))
        elif sigma is not None:
            by = abs(new - old) / sigma if sigma > 0.0 else math.inf
            in_sigmas.append(Change(where, old, new, by))
        else:
            relative.append(Change(where, old, new, abs(new - old) / max(abs(old), abs(new))))
    return Apart(
        tuple(sorted(in_sigmas, key=lambda c: -c.by)),
        tuple(sorted(relative, key=lambda c: -c.by)),
        _only(second, first),
        _only(first, second),
        tuple(said),
    )


def _number(x: object) -> bool:
    return isinstance(x, int | float) and not isinstance(x, bool)


def _leaves(
    x: Json, path: Path = (), sigma: Json = None
) -> Iterator[tuple[Path, tuple[Json, float | None]]]:
    """(path, (value, its sigma or None)) of all that has no parts."""
    if isinstance(x, Mapping):
        for key, part in x.items():
            yield from _leaves(part, (*path, key), _sigma_of(x, key))
    elif isinstance(x, Sequence) and not isinstance(x, str):
        beside = sigma if isinstance(sigma, Sequence) and len(sigma) == len(x) else [None] * len(x)
        for key, part, its in zip(_keys(x), x, beside, strict=True):
            yield from _leaves(part, (*path, key), its)
    else:
        yield path, (x, float(sigma) if _number(x) and _number(sigma) else None)


def _sigma_of(beside: Mapping[str, Json], key: str) -> Json:
    if key in OF_SIGMA:
        return beside.get("sigma")
    return beside.get(f"{key}_sigma", beside.get(f"sigma_{key}"))


def _keys(members: Sequence[Json]) -> Iterator[str]:
    """What each member of a list is known by; ``#2`` is the second of the same name."""
    seen: Counter[str] = Counter()
    for k, one in enumerate(members):
        key = one if isinstance(one, str) else f"[{k}]"
        if isinstance(one, Mapping):
            key = next((f"{one[by]}" for by in KNOWN_BY if by in one), key)
        seen[key] += 1
        yield key if seen[key] == 1 else f"{key} #{seen[key]}"


def _only(here: Mapping[Path, object], there: Mapping[Path, object]) -> tuple[str, ...]:
    """The beginnings of paths that are here and not there, each once."""
    known = {path[:n] for path in there for n in range(len(path) + 1)}
    out: dict[str, None] = {}
    for path in here:
        n = next((n for n in range(len(path) + 1) if path[:n] not in known), None)
        if n is not None:
            out["/".join(path[:n])] = None
    return tuple(out)
