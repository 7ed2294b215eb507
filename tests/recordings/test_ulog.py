"""What is made of a ULog's topics: units, and which of several instances."""

from __future__ import annotations

import struct

import pytest

from onboard.core.inputs.samples import AirData, Battery
from onboard.recordings.opening import open_recording
from tests.recordings.telemetry_writer import px4_log

CALIBRATED, INDICATED, TRUE = 20.0, 19.0, 21.0


def message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


def log(path, topics, n=20):
    """A log with more topics: ``{(name, instance): {field: value}}``, floats all of them."""
    out = px4_log(2)
    for name in dict.fromkeys(name for name, _ in topics):
        fields = next(values for (other, _), values in topics.items() if other == name)
        layout = "".join(f"float {field};" for field in fields)
        out += message("F", f"{name}:uint64_t timestamp;{layout}".encode())
    for number, (name, instance) in enumerate(topics, 100):
        out += message("A", struct.pack("<BH", instance, number) + name.encode())
    for k in range(n):
        for number, values in enumerate(topics.values(), 100):
            t = 2_000_000 + 100_000 * k + number
            out += message("D", struct.pack(f"<HQ{len(values)}f", number, t, *values.values()))
    path.write_bytes(out)
    return path


def speeds(**values):
    return {f"{name}_airspeed_m_s": value for name, value in values.items()}


def airspeeds(path):
    return [s.airspeed for s in open_recording(path).samples() if isinstance(s, AirData)]


@pytest.mark.parametrize(
    ("topic", "fields", "said"),
    [
        ("airspeed", speeds(indicated=INDICATED, true=TRUE), INDICATED),
        (
            "airspeed_validated",
            speeds(indicated=INDICATED, calibrated=CALIBRATED, true=TRUE),
            CALIBRATED,
        ),
        (
            "airspeed_validated",
            speeds(indicated=INDICATED, equivalent=CALIBRATED, true=TRUE),
            CALIBRATED,
        ),
    ],
)
def test_an_airspeed_is_what_the_sensor_says(tmp_path, topic, fields, said):
    """By the names of all of PX4's versions; never the true one, which is more with height."""
    assert airspeeds(log(tmp_path / "x.ulg", {(topic, 0): fields})) == [said] * 20


def test_a_true_airspeed_alone_is_none(tmp_path):
    assert airspeeds(log(tmp_path / "x.ulg", {("airspeed", 0): speeds(true=TRUE)})) == []


def test_one_of_two_batteries_is_read(tmp_path):
    """The first, as of other logs: a pack of 5 V beside it is no sag of ten volts."""
    its = [{"voltage_v": volts, "current_a": 3.0} for volts in (15.5, 5.0)]
    path = log(tmp_path / "x.ulg", {("battery_status", k): one for k, one in enumerate(its)})
    read = [s.voltage for s in open_recording(path).samples() if isinstance(s, Battery)]
    assert read == [15.5] * 20


@pytest.mark.parametrize("chosen", [True, False])
def test_one_of_two_airspeed_sensors_is_read(tmp_path, chosen):
    """That which PX4 has chosen, where it says so."""
    its = {("airspeed", k): speeds(indicated=INDICATED + k, true=TRUE) for k in range(2)}
    if chosen:
        its["airspeed_validated", 0] = speeds(calibrated=CALIBRATED)
    path = log(tmp_path / "x.ulg", its)
    assert airspeeds(path) == [CALIBRATED if chosen else INDICATED] * 20
