from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from dataflash_writer import DataflashWriter, modern_log
from results import CALIBRATED
from telemetry_writer import px4_log, telemetry

from onboard.core.samples import GpsFix, ImuSample, ParameterValue
from onboard.errors import RecordingError, UsageError
from onboard.replay import replay


class Listener:
    """Stands for the estimator: remembers what it was fed."""

    def __init__(self) -> None:
        self.samples: list = []
        self.finished: list[int] = []

    def feed(self, sample: object) -> None:
        self.samples.append(sample)

    def finish(self) -> None:
        self.finished.append(len(self.samples))

    @property
    def imus(self) -> tuple[int, ...]:
        return tuple(sorted({s.imu for s in self.samples if isinstance(s, ImuSample)}))

    def calibration(self, imu: int) -> object:
        return replace(CALIBRATED, imu=imu)


def saved(tmp_path: Path, name: str, data: object) -> Path:
    path = tmp_path / name
    path.write_bytes(bytes(data))
    return path


def with_device(device: int) -> DataflashWriter:
    log = modern_log(1)
    log.add("PARM", 6_000_000, "INS_ACC_ID", float(device), 0.0)
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


def test_one_accelerometer_on_request_and_none_that_is_not_there(tmp_path):
    path = saved(tmp_path, "a.BIN", modern_log(1))
    assert [c.imu for c in replay([path], Listener(), imu=2).calibrations] == [2]
    with pytest.raises(UsageError, match=r"no accelerometer 3 .*there: 1, 2"):
        replay([path], Listener(), imu=3)


def test_several_files_are_fed_to_one_estimator_which_is_finished_after_each(tmp_path):
    first = saved(tmp_path, "a.tlog", telemetry(2))
    second = saved(tmp_path, "b.BIN", modern_log(1))
    listener = Listener()
    result = replay([first, second], listener)
    alone = Listener()
    replay([first], alone)
    assert listener.finished == [len(alone.samples), len(listener.samples)]
    assert [r.path for r in result.recordings] == [first, second]
    assert result.document().recording.files == [str(first), str(second)]


def test_recordings_of_another_vehicle_are_refused(tmp_path):
    mine, same, other = (
        saved(tmp_path, f"{k}.BIN", with_device(device))
        for k, device in enumerate((2_753_028, 2_753_028, 2_753_036))
    )
    assert len(replay([mine, same], Listener()).recordings) == 2
    with pytest.raises(RecordingError, match=r"2\.BIN: of another vehicle .*INS_ACC_ID is 2753036"):
        replay([mine, other], Listener())


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
