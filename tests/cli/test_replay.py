from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from onboard.answers.recorded import unanswered
from onboard.answers.replay import replay
from onboard.core.estimate.result import Status
from onboard.core.inputs.samples import GpsFix, ImuSample, ParameterValue
from onboard.core.maths.accelerometer import parameter_names
from onboard.errors import RecordingError, UsageError
from onboard.recordings.opening import open_recording
from tests.cli.results import CALIBRATED
from tests.recordings.dataflash_writer import DataflashWriter, modern_log
from tests.recordings.telemetry_writer import px4_log, telemetry


class Listener:
    """Stands for the estimator: remembers what it was fed."""

    def __init__(self) -> None:
        self.samples: list = []
        self.finished: list[int] = []
        self.standing_s = 0.0
        self.restarted: list[int] = []

    def feed(self, sample: object) -> None:
        self.samples.append(sample)

    def restart(self) -> None:
        self.restarted.append(len(self.samples))

    def finish(self) -> None:
        self.finished.append(len(self.samples))

    @property
    def imus(self) -> tuple[int, ...]:
        return tuple(sorted({s.imu for s in self.samples if isinstance(s, ImuSample)}))

    @property
    def parameters(self) -> dict[str, float]:
        return {s.name: s.value for s in self.samples if isinstance(s, ParameterValue)}

    def answer(self, imu: int) -> object:
        return unanswered(replace(CALIBRATED, imu=imu))

    def compared(self, calibrations: object) -> None:
        """It keeps no flight to compare."""


def saved(tmp_path: Path, name: str, data: object) -> Path:
    path = tmp_path / name
    path.write_bytes(bytes(data))
    return path


def with_device(device: int, flight: int = 0) -> DataflashWriter:
    log = modern_log(1)
    log.add("PARM", 6_000_000, "INS_ACC_ID", float(device), 0.0)
    log.add("PARM", 6_000_000, "STAT_BOOTCNT", float(flight), 0.0)
    return log


def test_every_accelerometer_gets_an_answer(tmp_path):
    path = saved(tmp_path, "a.BIN", modern_log(2))
    listener = Listener()
    result = replay([path], listener)
    assert [c.imu for c in result.calibrations] == [1, 2]
    assert result.counts == {"imu 1": 50, "imu 2": 50, "gps": 10}
    assert result.duration_s == pytest.approx(1.96)
    assert listener.finished == [len(listener.samples)]
    assert {type(s) for s in listener.samples} >= {ImuSample, GpsFix, ParameterValue}


def test_of_a_file_that_was_read_no_places_are_kept_and_a_recording_stays_open(tmp_path):
    path = saved(tmp_path, "a.BIN", modern_log(2))
    (closed,) = replay([path], Listener()).recordings
    assert list(closed.samples()) == list(closed.pieces()) == []
    given = open_recording(path)
    assert replay([given], Listener()).recordings == (given,)
    assert closed.duration_s == given.duration_s
    assert len(list(given.samples())) > 100


def test_one_accelerometer_on_request_and_none_that_is_not_there(tmp_path):
    path = saved(tmp_path, "a.BIN", modern_log(1))
    assert [c.imu for c in replay([path], Listener(), imu=2).calibrations] == [2]
    with pytest.raises(UsageError, match=r"no accelerometer 3 .*there: 1, 2"):
        replay([path], Listener(), imu=3)


def test_several_files_are_fed_to_one_estimator_with_a_restart_between(tmp_path):
    first = saved(tmp_path, "a.tlog", telemetry(2))
    second = saved(tmp_path, "b.BIN", modern_log(1))
    listener = Listener()
    result = replay([first, second], listener)
    alone = Listener()
    replay([first], alone)
    assert (alone.restarted, alone.finished) == ([], [len(alone.samples)])
    assert listener.restarted == [len(alone.samples)]
    assert listener.finished == [len(listener.samples)]
    assert [r.path for r in result.recordings] == [first, second]
    assert result.document().recording.files == [str(first), str(second)]


class OnlyTheFirst(Listener):
    """An estimator that could make nothing of the other accelerometers."""

    @property
    def imus(self) -> tuple[int, ...]:
        return (1,)


class NoneAtAll(Listener):
    @property
    def imus(self) -> tuple[int, ...]:
        return ()


def test_accelerometers_without_an_answer_are_named(tmp_path):
    path = saved(tmp_path, "a.BIN", modern_log(1))
    result = replay([path], OnlyTheFirst())
    assert [c.imu for c in result.calibrations] == [1]
    assert "accelerometer 2: 25 samples" in result.document().recording.notes[0]
    (asked,) = replay([path], OnlyTheFirst(), imu=2).calibrations
    assert asked.status is Status.INSUFFICIENT


def test_without_any_answer_each_accelerometer_is_insufficient(tmp_path):
    log = modern_log(1)
    for name in parameter_names(1).six:
        log.add("PARM", 9_000_000, name, 1.01 if "SCAL" in name else 0.25, 0.0)
    document = replay([saved(tmp_path, "a.BIN", log)], NoneAtAll()).document()
    first, second = document.imus
    assert (first.status, second.status) == ("insufficient", "insufficient")
    assert first.in_force.offset == pytest.approx([0.25] * 3)
    assert (first.parameters_known, second.parameters_known) == (True, False)
    assert first.calibration.scale_sigma == [None] * 3
    assert json.loads(document.to_json())["imus"][0]["trusted_s"] == 0.0


def test_recordings_of_another_vehicle_are_refused(tmp_path):
    mine, same, other = (
        saved(tmp_path, f"{k}.BIN", with_device(device, k))
        for k, device in enumerate((2_753_028, 2_753_028, 2_753_036))
    )
    assert len(replay([mine, same], Listener()).recordings) == 2
    with pytest.raises(RecordingError, match=r"2\.BIN: of another vehicle .*INS_ACC_ID is 2753036"):
        replay([mine, other], Listener())


def test_a_flight_is_not_counted_twice(tmp_path):
    path = saved(tmp_path, "a.BIN", modern_log(1))
    again = tmp_path / "again.BIN"
    again.symlink_to(path)
    with pytest.raises(UsageError, match="given twice"):
        replay([path, again], Listener())


def test_autopilots_are_not_mixed(tmp_path):
    mine = saved(tmp_path, "a.BIN", modern_log(1))
    other = saved(tmp_path, "b.ulg", px4_log(1))
    with pytest.raises(RecordingError, match=r"b\.ulg: of another vehicle"):
        replay([mine, other], Listener())


def test_a_bad_file_is_told_before_any_work(tmp_path):
    good = saved(tmp_path, "a.BIN", modern_log(1))
    listener = Listener()
    with pytest.raises(RecordingError, match="no such file"):
        replay([good, tmp_path / "absent.BIN"], listener)
    assert listener.samples == []


def test_progress_goes_from_nothing_to_all(tmp_path):
    path = saved(tmp_path, "a.BIN", modern_log(60))
    heard: list[float] = []
    replay([path], Listener(), progress=heard.append)
    assert len(heard) > 1
    assert heard == sorted(heard)
    assert heard[-1] == 1.0
