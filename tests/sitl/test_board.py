"""Which board the built-in autopilot is, and how it is changed for another one."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin.truth import BOARD, ImuTruth, random_imus
from tests.sitl.test_parameter_manners import Peer

OTHER = "31".ljust(36, "0")
VERSION = int(mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)


def uid2(peer, command=mav.MAV_CMD_REQUEST_MESSAGE, parameter=VERSION):
    packed = [command, 0, float(parameter), *[0.0] * 6]
    peer.send(mav.MAVLink_command_long_message(1, 1, *packed))
    (message,) = (m for m in peer.drain() if m.get_type() == "AUTOPILOT_VERSION")
    assert message.uid == 0, "ArduPilot fills in the long id only"
    return bytes(message.uid2).hex()


def sixes(autopilot):
    return autopilot.parameters.vector("INS_ACCSCAL_") + autopilot.parameters.vector("INS_ACCOFFS_")


def boot_time(peer):
    (m, *_) = (m for m in peer.run(1.0) if m.get_type() == "SYSTEM_TIME")
    return m.time_boot_ms * 1e-3


@pytest.mark.parametrize(
    ("command", "parameter"),
    [
        (mav.MAV_CMD_REQUEST_MESSAGE, VERSION),
        (mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1),
    ],
)
def test_it_tells_its_unique_id_to_both_commands(command, parameter):
    assert uid2(Peer(), command, parameter) == BOARD


def test_old_command_without_its_one_fails_as_in_ardupilot():
    peer = Peer()
    result = peer.command(mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 0.0)
    assert result == mav.MAV_RESULT_FAILED


def test_a_board_can_be_one_that_tells_none():
    assert uid2(Peer(board="")) == "00" * 18


def test_another_board_of_the_model_has_the_same_device_ids_and_all_else_its_own():
    peer = Peer(imus=random_imus(1, 2))
    peer.set("INS_ACCOFFS_X", 0.2)
    peer.run(20.0)
    devices = [peer.autopilot.parameters[name] for name in ("INS_ACC_ID", "INS_ACC2_ID")]
    imus = random_imus(2, 2)
    assert peer.autopilot.swap_board(OTHER, imus, {"INS_ACCSCAL_Y": 1.01})
    assert boot_time(peer) < 2.0
    assert uid2(peer) == OTHER
    assert [peer.autopilot.parameters[name] for name in ("INS_ACC_ID", "INS_ACC2_ID")] == devices
    assert sixes(peer.autopilot) == pytest.approx((1.0, 1.01, 1.0, 0.001, 0.001, 0.001))
    assert peer.autopilot.truth.imus[1].scale == pytest.approx(imus[1].scale)
    raw = peer.autopilot.world.pieces[0].imus[0].raw.mean(axis=0)
    assert raw[:2] == pytest.approx(imus[0].offset[:2], abs=0.05), "its sensors are the new ones"


def test_the_board_taken_out_remembers_nothing_of_the_other():
    peer = Peer()
    peer.autopilot.swap_board(OTHER, (ImuTruth(),), {"INS_ACCOFFS_X": 0.25})
    peer.autopilot.swap_board(BOARD, (ImuTruth(),))
    assert sixes(peer.autopilot) == pytest.approx((1.0, 1.0, 1.0, 0.001, 0.001, 0.001))


def test_a_power_cycle_keeps_board_and_parameters_and_starts_the_clock():
    peer = Peer()
    peer.set("INS_ACCOFFS_X", 0.2)
    peer.run(20.0)
    assert peer.autopilot.power_cycle()
    assert boot_time(peer) < 2.0
    assert uid2(peer) == BOARD
    assert peer.autopilot.parameters["INS_ACCOFFS_X"] == pytest.approx(0.2)


def test_without_power_nothing_is_said_and_nothing_heard_until_it_is_back():
    peer = Peer()
    assert peer.autopilot.power_cycle(off=7.0)
    peer.drain()
    before = peer.autopilot.clock
    peer.set("INS_ACCOFFS_X", 0.2)
    assert peer.run(6.9) == []
    assert peer.autopilot.clock == pytest.approx(before + 6.9)
    assert peer.autopilot.parameters["INS_ACCOFFS_X"] == pytest.approx(0.001)
    assert boot_time(peer) < 1.0
    assert peer.autopilot.clock == pytest.approx(before + 7.9, abs=0.01)


def test_neither_is_done_while_armed():
    peer = Peer()
    assert peer.autopilot.arm(force=True) == []
    assert not peer.autopilot.power_cycle()
    assert not peer.autopilot.swap_board(OTHER, (ImuTruth(),))
    assert uid2(peer) == BOARD


def test_a_board_with_other_sensors_is_no_board_of_the_model():
    with pytest.raises(ValueError, match="1 inertial"):
        Peer().autopilot.swap_board(OTHER, random_imus(1, 2))
