"""What the outlets make of a snapshot: the news in it, once."""

import pytest

from onboard.daemon.outlets.outlets import Outlets
from onboard.daemon.setup.configuration import from_mapping
from onboard.daemon.view.notices import Notices
from tests.gcs.vehicles_state import accelerometer, proposal, seen


class Stage:
    """Outlets around a service whose snapshot a test sets."""

    def __init__(self, **sections):
        self.now = 0.0
        self.shown = seen()
        self.kept = []
        notices = Notices(lambda: 0.0)
        notices.listen(self.kept.append)
        self.outlets = Outlets(
            from_mapping(sections, source="test"), self, notices, clock=lambda: self.now
        )
        self.participants = []
        self.outlets.join(self.participants.append)

    def snapshot(self):
        return self.shown

    def show(self, **changes):
        self.shown = seen(**changes)
        self.outlets.publish()

    def told(self, kind):
        return [notice.text for notice in self.kept if notice.kind == kind]


def diagnosis(*names, verdict="explained"):
    effects = [{"name": n, "share_of_mismatch": 1.0 / (i + 1)} for i, n in enumerate(names)]
    return {"verdict": verdict, "effects": effects}


def test_missing_physics_is_told_once_for_each_answer():
    stage = Stage()
    for _ in range(3):
        stage.show(diagnosis=diagnosis("cross_axis", "mount_tilt"))
    stage.show(diagnosis=diagnosis("mount_tilt"))
    stage.show(diagnosis=diagnosis(verdict="clean"))
    stage.show(diagnosis=diagnosis(verdict="unexplained"))
    assert stage.told("physics_missing") == [
        "physics missing: cross axis",
        "physics missing: mount tilt",
        "physics missing: no known effect",
    ]


def test_a_late_receiver_is_worth_knowing_and_no_alarm():
    stage = Stage()
    stage.show(diagnosis=diagnosis("gps_latency", "gps_smoothing"))
    assert stage.told("worth_knowing") == ["worth knowing: gps latency"]
    assert stage.told("physics_missing") == []


def test_what_falsifies_the_numbers_is_told_however_small_its_share():
    stage = Stage()
    stage.show(diagnosis=diagnosis("gps_latency", "gps_lever_arm"))
    assert stage.told("physics_missing") == ["physics missing: gps lever arm"]


@pytest.mark.parametrize("verdict", ["clean", "insufficient"])
def test_a_clean_flight_is_no_news(verdict):
    stage = Stage()
    stage.show(diagnosis=None)
    stage.show(diagnosis=diagnosis(verdict=verdict))
    assert stage.kept == []


def test_a_person_is_called_each_time_one_is_waited_for():
    stage = Stage()
    for held_back in (["approval", "armed"], ["approval"], ["approval"], [], ["approval"]):
        stage.show(imus=[accelerometer(1)], proposals=[proposal(*held_back)])
    assert len(stage.told("approval_needed")) == 2


def test_what_will_not_be_written_is_told_on_the_ground_once():
    stage = Stage()
    for _ in range(2):
        stage.show(imus=[accelerometer(1), accelerometer(2, stands="held_back")])
    assert stage.told("imu_state") == ["IMU 2: held back"]
    stage.show(imus=[accelerometer(1), accelerometer(2, stands="up_to_date")])
    stage.show(imus=[accelerometer(1), accelerometer(2, stands="insufficient")])
    assert stage.told("imu_state")[1:] == ["IMU 2: insufficient"]


def test_every_tick_reaches_the_parameters():
    stage = Stage()
    (server, _announcer) = stage.participants
    assert server.values["OBC_1_STAT"] == 0.0
    stage.show(imus=[accelerometer(1)])
    assert server.values["OBC_1_STAT"] == 2.0


def test_what_is_switched_off_is_not_there_but_the_log_has_the_news():
    stage = Stage(parameters={"enabled": False, "messages": False})
    assert stage.participants == []
    stage.show(diagnosis=diagnosis("gps_lever_arm"))
    assert stage.outlets.counters == {}
    assert len(stage.told("physics_missing")) == 1
