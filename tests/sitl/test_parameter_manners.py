"""The parameter protocol from the client's side: ArduPilot's quirks, one by one."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin.autopilot import Autopilot
from sitl.builtin.truth import ImuTruth, Truth


class Peer:
    """A client with real frames in both directions, and a second one that only listens."""

    def __init__(self, vehicle="copter", **more):
        self.autopilot = Autopilot(vehicle, Truth(**more))
        self.links = [self.autopilot.connect(), self.autopilot.connect()]
        self._packer = mav.MAVLink(None, srcSystem=255, srcComponent=190)
        self._back = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        self.run(0.1)

    def send(self, message):
        for parsed in mav.MAVLink(None).parse_buffer(message.pack(self._packer)):
            self.autopilot.receive(self.links[0], parsed)

    def run(self, seconds, link=0):
        for other in self.links:
            other.outbox.clear()
        self.autopilot.advance(seconds)
        return self.drain(link)

    def drain(self, link=0):
        frames = [m.pack(self._back) for _, m in self.links[link].outbox]
        self.links[link].outbox.clear()
        return [m for f in frames for m in mav.MAVLink(None).parse_buffer(f)]

    def set(self, name, value, kind=9):
        self.send(mav.MAVLink_param_set_message(1, 1, name.encode(), value, kind))

    def read(self, name="", index=-1):
        self.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), index))

    def command(self, number, *parameters):
        p = [*parameters, *[0.0] * (7 - len(parameters))]
        self.send(mav.MAVLink_command_long_message(1, 1, number, 0, *p))
        acks = [m for m in self.drain() if m.get_type() == "COMMAND_ACK"]
        return acks[-1].result


def values(messages):
    return [m for m in messages if m.get_type() == "PARAM_VALUE"]


def texts(messages):
    return [m.text for m in messages if m.get_type() == "STATUSTEXT"]


@pytest.fixture
def peer():
    return Peer()


def test_read_by_name_and_by_index(peer):
    peer.read("INS_ACCSCAL_X")
    (by_name,) = values(peer.drain())
    assert (by_name.param_id, by_name.param_value, by_name.param_index) == (
        "INS_ACCSCAL_X",
        1,
        65535,
    )
    peer.read(index=3)
    (by_index,) = values(peer.drain())
    assert by_index.param_index == 3


def test_unknown_names_indices_and_nan_are_met_with_silence(peer):
    peer.read("NO_SUCH_THING")
    peer.read(index=30_000)
    peer.set("NO_SUCH_THING", 1.0)
    peer.set("INS_ACCSCAL_X", float("nan"))
    peer.set("INS_ACCSCAL_X", float("inf"))
    assert values(peer.drain()) == []
    assert values(peer.run(0.5)) == []
    assert peer.autopilot.parameters["INS_ACCSCAL_X"] == 1.0


def test_set_takes_effect_at_once_and_is_broadcast_when_saved(peer):
    peer.set("INS_ACCOFFS_Y", 0.1)
    assert peer.autopilot.parameters["INS_ACCOFFS_Y"] == np.float32(0.1)
    assert values(peer.drain()) == []
    peer.autopilot.advance(0.2)
    for link in (0, 1):
        (saved,) = values(peer.drain(link))
        assert saved.param_index == 65535
        assert saved.param_value == np.float32(0.1)


def test_type_field_is_ignored_and_integers_are_truncated(peer):
    peer.set("INS_ACCEL_FILTER", 30.9, kind=1)
    (saved,) = values(peer.run(0.2))
    assert saved.param_value == 30.0
    assert saved.param_type == mav.MAV_PARAM_TYPE_INT16


def test_read_only_is_refused_with_the_old_value_and_a_text(peer):
    peer.set("FORMAT_VERSION", 3.0)
    answer = peer.drain()
    assert [m.param_value for m in values(answer)] == [120.0]
    assert texts(answer) == ["Param write denied (FORMAT_VERSION)"]
    assert values(peer.run(0.5)) == []


def test_messages_for_another_vehicle_are_ignored(peer):
    peer.send(mav.MAVLink_param_set_message(2, 1, b"INS_ACCOFFS_X", 0.5, 9))
    peer.run(0.2)
    assert peer.autopilot.parameters["INS_ACCOFFS_X"] == np.float32(0.001)


def test_list_carries_everything_in_order(peer):
    peer.send(mav.MAVLink_param_request_list_message(1, 1))
    received = values(peer.run(3.0))
    assert [m.param_index for m in received] == list(range(received[0].param_count))
    assert len({m.param_id for m in received}) == received[0].param_count


def test_list_goes_only_to_who_asked(peer):
    peer.send(mav.MAVLink_param_request_list_message(1, 1))
    assert values(peer.run(3.0, link=1)) == []


@pytest.mark.parametrize(
    ("vehicle", "interval_us", "accepted"),
    [
        ("copter", 5000, True),
        ("copter", 3000, True),
        ("copter", 2999, False),
        ("plane", 25_000, True),
        ("plane", 24_999, False),
        ("plane", 20_000, False),
    ],
)
def test_message_interval_is_refused_beyond_the_loop_rate(vehicle, interval_us, accepted):
    peer = Peer(vehicle)
    result = peer.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 27, interval_us)
    assert result == (mav.MAV_RESULT_ACCEPTED if accepted else mav.MAV_RESULT_DENIED)


@pytest.mark.parametrize("asked_us", [20_000, 20_900, 100_000])
def test_message_interval_in_whole_milliseconds(peer, asked_us):
    peer.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 27, asked_us)
    sent = [m.time_usec for m in peer.run(10.0) if m.get_type() == "RAW_IMU"]
    assert np.mean(np.diff(sent)) == pytest.approx(asked_us // 1000 * 1000, rel=2e-3)
    peer.command(mav.MAV_CMD_GET_MESSAGE_INTERVAL, 27)
    peer.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 27, -1)
    assert not [m for m in peer.run(2.0) if m.get_type() == "RAW_IMU"]


def test_interval_zero_is_the_default_of_the_stream_rates(peer):
    peer.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 27, 10_000)
    peer.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 27, 0)
    assert len([m for m in peer.run(10.0) if m.get_type() == "RAW_IMU"]) == pytest.approx(20, abs=1)


def test_intervals_belong_to_one_link(peer):
    peer.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 105, 20_000)
    assert not [m for m in peer.run(1.0, link=1) if m.get_type() == "HIGHRES_IMU"]


def test_unknown_message_and_unknown_command(peer):
    assert peer.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 9999, 1e5) == mav.MAV_RESULT_DENIED
    assert peer.command(31_010) == mav.MAV_RESULT_UNSUPPORTED


def test_request_data_stream(peer):
    peer.send(mav.MAVLink_request_data_stream_message(1, 1, 10, 25, 1))
    assert len([m for m in peer.run(4.0) if m.get_type() == "ATTITUDE"]) == pytest.approx(
        100, abs=2
    )


def test_timesync_is_answered_on_the_boot_clock(peer):
    peer.autopilot.advance(1.0)
    peer.drain()
    peer.send(mav.MAVLink_timesync_message(0, 123456789))
    (answer,) = [m for m in peer.drain() if m.get_type() == "TIMESYNC"]
    assert answer.ts1 == 123456789
    assert answer.tc1 == pytest.approx(peer.autopilot.now * 1e9, abs=1e3)
    peer.send(mav.MAVLink_timesync_message(5, 5))  # an answer, not a question
    assert not [m for m in peer.drain() if m.get_type() == "TIMESYNC"]


def test_reboot_forgets_intervals_and_keeps_parameters(peer):
    peer.set("INS_ACCOFFS_X", 0.25)
    peer.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 27, 20_000)
    peer.run(5.0)
    assert peer.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == mav.MAV_RESULT_ACCEPTED
    after = [m for m in peer.run(2.0) if m.get_type() == "RAW_IMU"]
    assert after[0].time_usec < 1e6
    assert len(after) < 6
    assert peer.autopilot.parameters["INS_ACCOFFS_X"] == 0.25
    assert peer.autopilot.parameters["STAT_BOOTCNT"] == 2.0


def test_arming_wants_calibrated_and_consistent_accelerometers():
    peer = Peer(imus=(ImuTruth(), ImuTruth(offset=(0.9, 0.0, 0.0))))
    peer.run(8.0)
    assert peer.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mav.MAV_RESULT_FAILED
    peer.set("INS_ACC2OFFS_X", 0.9)
    for axis in "XYZ":
        peer.set(f"INS_ACCOFFS_{axis}", 0.0)
    peer.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    assert not peer.autopilot.armed
    peer.set("INS_ACCOFFS_X", 0.001)
    assert peer.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mav.MAV_RESULT_ACCEPTED
    peer.autopilot.advance(1.0)
    assert [m.base_mode & 128 for m in peer.drain() if m.get_type() == "HEARTBEAT"] == [128]


def test_arming_says_why_not():
    peer = Peer()
    for axis in "XYZ":
        peer.set(f"INS_ACCOFFS_{axis}", 0.0)
    peer.run(8.0)
    peer.send(mav.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    assert "Arm: 3D Accel calibration needed" in texts(peer.drain())


@pytest.mark.slow
def test_no_reboot_and_no_second_flight_while_armed(peer):
    peer.run(8.0)
    peer.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    assert peer.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == mav.MAV_RESULT_FAILED
    assert peer.command(mav.MAV_CMD_NAV_TAKEOFF) == mav.MAV_RESULT_ACCEPTED
    assert peer.command(mav.MAV_CMD_NAV_TAKEOFF) == mav.MAV_RESULT_FAILED
    peer.run(20.0)
    assert peer.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0) == mav.MAV_RESULT_FAILED


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["plane", "copter"])
def test_flies_lands_and_flies_again(vehicle):
    peer = Peer(vehicle)
    peer.run(8.0)
    for _ in range(2):
        assert peer.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mav.MAV_RESULT_ACCEPTED
        peer.command(mav.MAV_CMD_NAV_TAKEOFF)
        peer.run(40.0)
        assert not peer.autopilot.instant().landed
        peer.command(mav.MAV_CMD_NAV_LAND)
        peer.run(130.0)
        assert peer.autopilot.instant().landed
        assert not peer.autopilot.armed
        assert not peer.autopilot.flying


def test_changed_truth_changes_the_sensor_from_now_on(peer):
    peer.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 27, 20_000)
    before = np.mean([m.xacc for m in peer.run(2.0) if m.get_type() == "RAW_IMU"])
    peer.set("SIM_ACC1_BIAS_X", 0.5)
    after = np.mean([m.xacc for m in peer.run(2.0) if m.get_type() == "RAW_IMU"])
    assert after - before == pytest.approx(0.5 / 9.80665e-3, abs=1.5)
    peer.set("INS_ACCOFFS_X", 0.501)
    cured = np.mean([m.xacc for m in peer.run(2.0) if m.get_type() == "RAW_IMU"])
    assert cured == pytest.approx(before, abs=1.0)
