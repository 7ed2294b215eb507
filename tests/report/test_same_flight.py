"""Recordings that are used together: flights of their own, of one vehicle."""

from dataclasses import replace

import pytest

from onboard.answers.explain import explain
from onboard.answers.match import match
from onboard.answers.recorded_vehicle import Vehicle
from onboard.answers.replay import read
from onboard.core.inputs.samples import GpsFix
from onboard.errors import RecordingError, UsageError
from onboard.recordings.opening import open_recording
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.recording import FlightSpec, write_tlog
from tests.recordings.simulated_log import logged


class Reader:
    """Only counts."""

    standing_s = 0.0

    def __init__(self):
        self.taken = 0

    def feed(self, _):
        self.taken += 1

    def restart(self):
        pass

    def finish(self):
        pass


def spec(seed, duration=110.0, **more):
    return FlightSpec(
        vehicle="copter", seed=seed, duration=duration, imus=random_imus(seed), **more
    )


def samples_of(path):
    return list(open_recording(path).samples())


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    """Telemetry of two flights, and the log of the first."""
    folder = tmp_path_factory.mktemp("flights")
    paths = []
    for seed in (31, 32):
        path = folder / f"{seed}.tlog"
        write_tlog(spec(seed), path)
        paths.append(path)
    log = folder / "31.BIN"
    log.write_bytes(bytes(logged(samples_of(paths[0]), lambda _: 0.03)))
    return (*paths, log)


def test_two_flights_are_two(flights):
    first, second, _ = flights
    assert len(read([first, second], Reader()).recordings) == 2


def test_a_copy_under_another_name_is_the_same_flight(flights, tmp_path):
    first, _, _ = flights
    copy = tmp_path / "copy.tlog"
    copy.write_bytes(first.read_bytes())
    with pytest.raises(UsageError, match=r"copy\.tlog: the same flight as .*31\.tlog"):
        read([first, copy], Reader())


def test_so_are_its_log_and_its_telemetry(flights):
    first, second, log = flights
    with pytest.raises(UsageError, match=r"31\.BIN: the same flight as"):
        read([second, first, log], Reader())


def test_a_part_of_it_is_the_same_flight_and_one_that_stood_is_none(flights, tmp_path):
    first, _, _ = flights
    samples = samples_of(first)
    part = tmp_path / "part.BIN"
    part.write_bytes(
        bytes(logged([s for s in samples if s.t is None or s.t > 60.0], lambda _: 0.0))
    )
    with pytest.raises(UsageError, match="the same flight"):
        read([first, part], Reader())
    still = [replace(s, v_n=0.0, v_e=0.0) if isinstance(s, GpsFix) else s for s in samples]
    stood = tmp_path / "stood.BIN"
    stood.write_bytes(bytes(logged(still, lambda _: 0.0)))
    assert len(read([first, stood], Reader()).recordings) == 2


def test_a_log_that_was_put_behind_itself_has_its_flight_twice(flights, tmp_path):
    _, _, log = flights
    twice = tmp_path / "twice.BIN"
    twice.write_bytes(log.read_bytes() * 2)
    with pytest.raises(RecordingError, match="the same flight is in it twice"):
        read([twice], Reader())


def test_nor_does_a_match_count_a_flight_twice(flights):
    first, _, log = flights
    with pytest.raises(UsageError, match="the same flight"):
        match(first, others=[log])


def on_board(path, words, to):
    log = logged(samples_of(path), lambda _: 0.0)
    log.format(40, "MSG", "QZ", "TimeUS,Message")
    log.add("MSG", 1, f"Pixhawk6X {words}")
    to.write_bytes(bytes(log))
    return to


def test_recordings_of_two_boards_are_not_merged(flights, tmp_path):
    first, second, _ = flights
    mine = on_board(first, "003E0026 3033510B 35303731", tmp_path / "mine.BIN")
    same = on_board(second, "003E0026 3033510B 35303731", tmp_path / "same.BIN")
    other = on_board(second, "003E0027 3033510B 35303731", tmp_path / "other.BIN")
    assert len(read([mine, same], Reader()).recordings) == 2
    with pytest.raises(RecordingError, match=r"other\.BIN: of another vehicle .*board 27003e00"):
        read([mine, other], Reader())
    with pytest.raises(RecordingError, match=r"other\.BIN: of another vehicle"):
        match(mine, others=[other])


@pytest.mark.slow
def test_a_second_log_does_not_move_what_the_latency_is_counted_from(tmp_path):
    """The moment of arrival is of the boot clock, too, which goes on where the first log ends."""
    paths = []
    for seed in (41, 42):
        path, tlog = tmp_path / f"{seed}.BIN", tmp_path / f"{seed}.tlog"
        write_tlog(spec(seed, gps=GpsTruth(delay=0.19, stamped_early=0.02)), tlog)
        path.write_bytes(bytes(logged(samples_of(tlog), lambda _: 0.032)))
        paths.append(path)
    alone, together = explain(paths[:1]).diagnosis, explain(paths).diagnosis
    told = []
    for said in (alone, together):
        (late,) = (e for e in said.effects if e.name == "gps_latency")
        assert "32 ms later" in late.cure
        told.append(late.parameters["GPS1_DELAY_MS"])
    assert told[1] == pytest.approx(told[0], abs=4.0)
    assert told[0] == pytest.approx(170.0, abs=4.0)


def test_a_copy_of_a_hover_is_one_though_it_went_nowhere(flights, tmp_path):
    still = [
        replace(s, v_n=0.0, v_e=0.0) if isinstance(s, GpsFix) else s for s in samples_of(flights[0])
    ]
    paths = [tmp_path / "a.BIN", tmp_path / "b.BIN"]
    for path in paths:
        path.write_bytes(bytes(logged(still, lambda _: 0.0)))
    with pytest.raises(UsageError, match=r"b\.BIN: the same flight as"):
        read(paths, Reader())


def test_a_receiver_whose_fix_is_old_begins_no_other_boot(flights):
    recording = open_recording(flights[0])
    vehicle = Vehicle()
    vehicle.begin()
    for sample in samples_of(flights[0]):
        vehicle.check(sample, recording)
        if isinstance(sample, GpsFix):
            vehicle.check(GpsFix(1.0, 2, 1, 0.0, 0.0, 0.0, 0.0, 0.0), recording)
    assert len(vehicle.tracks) == 2
    alone = Vehicle()
    alone.begin()
    for sample in samples_of(flights[0]):
        alone.check(sample, recording)
    assert vehicle.tracks[0].is_of(alone.tracks[0])
