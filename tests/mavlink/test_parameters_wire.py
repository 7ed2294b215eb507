"""Events and actions against the real codec: what is packed is what is parsed."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.mavlink.parameter_messages import (
    ErrorReceived,
    ParameterErrorCode,
    SendParamRead,
    SendParamSet,
    TextReceived,
    ValueReceived,
    parameter_event,
    parameter_message,
    to_float32,
)


def codec(system, component):
    return mavlink.MAVLink(None, srcSystem=system, srcComponent=component)


def through_the_wire(sender, message):
    (received,) = codec(0, 0).parse_buffer(message.pack(sender))
    return received


AUTOPILOT = codec(7, 1)
OURS = codec(7, 191)


def event(message, sender=AUTOPILOT, **kwargs):
    received = through_the_wire(sender, message)
    return parameter_event(received, system=7, own_system=7, own_component=191, **kwargs)


def test_value_keeps_all_its_bits_and_sixteen_characters():
    value = to_float32(0.9876543)
    message = mavlink.MAVLink_param_value_message(b"INS_ACC2OFFS_XYZ", value, 9, 1200, 65535)
    assert event(message) == ValueReceived("INS_ACC2OFFS_XYZ", value, 65535, 1200)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_finite_number_is_no_value(value):
    assert event(mavlink.MAVLink_param_value_message(b"INS_ACCOFFS_X", value, 9, 10, 0)) is None


def test_words_of_other_components_and_systems_are_not_the_autopilots():
    message = mavlink.MAVLink_param_value_message(b"OBC_STATE", 1.0, 9, 1, 0)
    assert event(message, OURS) is None
    assert event(message, codec(8, 1)) is None


def test_text_and_irrelevant_messages():
    assert event(mavlink.MAVLink_statustext_message(4, b"Param write denied (X)")) == TextReceived(
        "Param write denied (X)"
    )
    assert event(mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3)) is None


@pytest.mark.parametrize("code", [1, 2, 3, 5])
def test_error_for_us(code):
    message = mavlink.MAVLink_param_error_message(7, 191, b"X", -1, code)
    assert event(message) == ErrorReceived("X", ParameterErrorCode(code), 65535)


def test_error_of_a_newer_dialect_and_error_for_somebody_else():
    newer = mavlink.MAVLink_param_error_message(7, 191, b"X", -1, 77)
    assert event(newer) == ErrorReceived("X", ParameterErrorCode.OTHER, 65535)
    for system, component in ((255, 191), (7, 190)):
        other = mavlink.MAVLink_param_error_message(system, component, b"X", -1, 1)
        assert event(other) is None


def test_actions_are_what_an_autopilot_reads():
    value = to_float32(1.0123)
    sent = through_the_wire(
        OURS, parameter_message(SendParamSet("INS_ACCSCAL_X", value), OURS, system=7)
    )
    assert sent.get_type() == "PARAM_SET"
    assert (sent.target_system, sent.target_component) == (7, 1)
    assert (sent.param_id, sent.param_value, sent.param_type) == ("INS_ACCSCAL_X", value, 9)
    read = through_the_wire(OURS, parameter_message(SendParamRead("INS_ACC_ID"), OURS, system=7))
    assert (read.get_type(), read.param_id, read.param_index) == (
        "PARAM_REQUEST_READ",
        "INS_ACC_ID",
        -1,
    )


@pytest.mark.parametrize("value", [0.1, -3.5, 1.2, 0.0, 16777217.0])
def test_float32_is_idempotent(value):
    assert to_float32(to_float32(value)) == to_float32(value)
