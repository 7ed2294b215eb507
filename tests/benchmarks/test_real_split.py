"""The split of the real flights: nothing that is judged by was looked at before."""

from pathlib import Path

import pytest

from benchmarks.real.split import FLIGHTS, PARTS, SPLIT_BY_FLIGHT, available, table


def test_every_part_has_flights_and_no_file_is_in_two() -> None:
    files = [f.file for f in FLIGHTS]
    assert len(set(files)) == len(files)
    assert len({f.name for f in FLIGHTS}) == len(files)
    assert {f.part for f in FLIGHTS} == set(PARTS)


def test_no_vehicle_is_in_two_parts_but_the_one_that_is_split_by_flight() -> None:
    parts: dict[str, set[str]] = {}
    for f in FLIGHTS:
        parts.setdefault(f.vehicle, set()).add(f.part)
    assert {v for v, p in parts.items() if len(p) > 1} == SPLIT_BY_FLIGHT
    assert all(parts[v] == set(PARTS) for v in SPLIT_BY_FLIGHT)


def test_the_vehicle_that_is_split_by_flight_can_repeat_in_every_part() -> None:
    for vehicle in SPLIT_BY_FLIGHT:
        for part in PARTS:
            assert sum(f.vehicle == vehicle and f.part == part for f in FLIGHTS) >= 3


def test_a_flight_for_judging_is_not_to_be_had_by_name_elsewhere() -> None:
    kept = next(f for f in FLIGHTS if f.part == "judging")
    with pytest.raises(ValueError, match="it is for judging"):
        available("building", [kept.name])
    with pytest.raises(ValueError, match="there is none"):
        available("building", ["no-such-flight"])


def test_without_recordings_there_is_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("ONBOARD_RECORDINGS", str(tmp_path))
    assert available("building") == []


def test_the_table_names_every_flight_within_eighty_columns() -> None:
    lines = table().splitlines()
    assert all(any(line.startswith(f.name) for line in lines) for f in FLIGHTS)
    assert max(map(len, lines)) <= 80
