"""Whose a recording is: the same board by every kind of log, and nothing where it is not said."""

from __future__ import annotations

import math
import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from onboard.recordings.provenance import provenance
from onboard.recordings.ulog_information import ulog_information
from tests.recordings.dataflash_writer import DataflashWriter, modern_log
from tests.recordings.telemetry_writer import px4_log, telemetry

SERIAL = "26003e000b51333031373035"
TEXT = "Pixhawk6X 003E0026 3033510B 35303731"
PARAMETERS = {
    "SYSID_THISMAV": 7.0,
    "INS_ACC_ID": 3866898.0,
    "INS_ACC2_ID": 0.0,
    "GPS_DELAY_MS": 120.0,
    "GPS_POS1_X": 0.5,
    "GPS_POS1_Y": 0.0,
    "GPS_POS1_Z": -0.25,
    "FRAME_CLASS": 1.0,
}


def log(path, texts=(TEXT, "GPS 1: detected as u-blox at 230400 baud")):
    writer = modern_log(4)
    writer.format(40, "MSG", "QZ", "TimeUS,Message")
    for text in texts:
        writer.add("MSG", 1, text)
    for name, value in PARAMETERS.items():
        writer.add("PARM", 1, name, value, 0.0)
    path.write_bytes(bytes(writer))
    return path


def tlog(path, *messages):
    """Telemetry with more messages of an autopilot (component 1), each of a system."""
    data = bytes(telemetry(4))
    for system, message in messages:
        packer = mav.MAVLink(None, srcSystem=system, srcComponent=1)
        data += struct.pack(">Q", 1_700_000_000_000_000) + message.pack(packer)
    path.write_bytes(data)
    return path


def version(uid2):
    return mav.MAVLink_autopilot_version_message(
        0, 0, 0, 0, 0, bytes(8), bytes(8), bytes(8), 0, 0, 0, uid2.ljust(18, b"\0")
    )


def test_a_dataflash_log_says_board_receiver_and_when(tmp_path):
    found = provenance(log(tmp_path / "a.BIN"))
    assert (found.board, found.model, found.system) == (SERIAL, "Pixhawk6X", 7)
    assert found.accelerometers == {1: 3866898}
    assert (found.receiver, found.frame, found.told_delay_s) == ("u-blox", 1, 0.12)
    assert found.antenna_m == (0.5, 0.0, -0.25)
    # GPS week 2300, 1 s, 18 leap seconds; 19 more fixes at 5 Hz.
    assert found.began_unix_s == pytest.approx(315964800 + 2300 * 604800 + 1.0 - 18.0)
    assert found.ended_unix_s == pytest.approx(found.began_unix_s + 3.8)


def test_a_receiver_that_names_its_hardware_is_known_by_it(tmp_path):
    text = "u-blox 1 HW: 000A0000 SW: ROM SPG 5.10 (7b202e)"
    found = provenance(log(tmp_path / "a.BIN", ("GPS 1: detected as u-blox at 1 baud", text)))
    assert found.receiver == "u-blox 000A0000"


@pytest.mark.parametrize("text", ["RC Protocol: SBUS", "board 00000000 00000000 00000000", ""])
def test_no_serial_number_is_made_of_another_text(tmp_path, text):
    assert provenance(log(tmp_path / "a.BIN", (text,))).board == ""


def test_telemetry_has_the_same_number_in_its_own_form(tmp_path):
    system = int(provenance(tlog(tmp_path / "plain.tlog")).system)
    raw = bytes.fromhex(SERIAL)
    assert provenance(tlog(tmp_path / "a.tlog", (system, version(raw)))).board == SERIAL
    text = mav.MAVLink_statustext_message(6, TEXT.encode())
    assert provenance(tlog(tmp_path / "b.tlog", (system, text))).board == SERIAL


def test_telemetry_of_several_vehicles_says_nothing_of_either(tmp_path):
    beat = mav.MAVLink_heartbeat_message(2, 3, 81, 0, 4, 3)
    found = provenance(tlog(tmp_path / "a.tlog", (99, beat), (99, version(bytes(range(1, 13))))))
    assert (found.board, found.system, found.accelerometers) == ("", None, {})


def test_a_ulog_has_it_in_its_head_and_damage_ends_the_head(tmp_path):
    data = px4_log(5)
    key = b"char[24] sys_uuid"
    body = bytes([len(key)]) + key + SERIAL.encode()
    head = struct.pack("<HB", len(body), ord("I")) + body
    whole = tmp_path / "a.ulg"
    whole.write_bytes(data[:16] + head + data[16:])
    assert provenance(whole).board == SERIAL
    for cut in range(16, 16 + len(head)):
        whole.write_bytes((data[:16] + head)[:cut])
        assert ulog_information(whole).texts == {}


ODD = {
    "PARM": ("QNf", "TimeUS,Name,Value", (1, "FRAME_CLASS", 1.0)),
    "MSG": ("QZ", "TimeUS,Message", (1, TEXT)),
    "GPS": ("QBIH", "TimeUS,Status,GMS,GWk", (1, 3, 1000, 2300)),
}
"""What is asked for: letters, columns and values."""
OTHER = {"n": b"abcd", "a": bytes(64), "f": math.inf, "Z": b"text", "B": 3}


def odd(path, name, letters, values):
    """A log whose messages of one name are of another layout, and the others as they should be."""
    log = DataflashWriter()
    log.format(10, "IMU", "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    for kind, (its, (form, columns, usual)) in enumerate(ODD.items(), 20):
        log.format(kind, its, letters if its == name else form, columns)
        log.add(its, *(values if its == name else usual))
    for k in range(50):
        log.add("IMU", 20_000 * k, 0.0, 0.0, 0.0, 0.0, 0.0, -9.8)
    path.write_bytes(bytes(log))
    return path


def test_what_stands_in_the_log_as_it_should_is_known(tmp_path):
    known = provenance(odd(tmp_path / "x.BIN", "", "", ()))
    assert (known.board, known.frame) == (SERIAL, 1)
    assert known.began_unix_s == pytest.approx(315964800 + 2300 * 604800 + 1.0 - 18.0)


@pytest.mark.parametrize("other", OTHER)
@pytest.mark.parametrize("name", ODD)
def test_a_field_of_another_type_is_not_known(tmp_path, name, other):
    """Logs define their own layouts: whatever stands under a name, the others are known."""
    form, _, usual = ODD[name]
    for k, letter in enumerate(form):
        letters, values = form[:k] + other + form[k + 1 :], list(usual)
        values[k] = OTHER[other]
        known = provenance(odd(tmp_path / "x.BIN", name, letters, values))
        if (letter in "ZN") != (other in "Zn"):  # a number for a text, or the other way round
            said = {"PARM": known.frame, "MSG": known.board or None, "GPS": known.began_unix_s}
            assert said.pop(name) is None or k == 0
            assert None not in said.values()


def test_no_number_of_a_kind_is_made_of_damage(tmp_path):
    writer = DataflashWriter()
    writer.format(10, "IMU", "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    writer.format(14, "PARM", "Nf", "Name,Value")
    for value in (3e38, math.inf, math.nan):
        for name in ("FRAME_CLASS", "SYSID_THISMAV", "INS_ACC_ID"):
            writer.add("PARM", name, value)
        writer.add("IMU", 1, 0.0, 0.0, 0.0, 0.0, 0.0, -9.8)
        (tmp_path / "x.BIN").write_bytes(bytes(writer))
        known = provenance(tmp_path / "x.BIN")
        assert (known.frame, known.system, known.accelerometers) == (None, None, {})
