"""One recording with all that a match has to leave out or undo, from the file to the document.

The accelerometer is turned by five and four degrees, a gust front is met once, and for a while the
telemetry of the outputs is lost.
"""

import pytest

from sitl import recording
from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.effects import AccelerometerTilt
from sitl.builtin.truth import GpsTruth
from tests.sitl.altered import matched

TURNED = {"roll": 0.08, "pitch": -0.064}
AIR = Air(north=3.0, east=-2.0, gust_north=5.0, gust_start=45.0, gust_end=51.0)
LOST = (30.0, 36.0)


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What ``onboard match --json`` says of it."""
    spec = recording.FlightSpec(
        seed=4,
        duration=90.0,
        aircraft=Aircraft(craft=Airframe(), air=AIR),
        gps=GpsTruth(delay=0.12, stamped_early=0.02),
        effects=(AccelerometerTilt(**TURNED),),
    )

    def without_outputs(t, message):
        return not (message.get_type() == "SERVO_OUTPUT_RAW" and LOST[0] < t < LOST[1])

    return matched(tmp_path_factory.mktemp("left_out"), spec, without_outputs)


def test_a_tilt_of_the_accelerometer_is_none_of_the_thrust(told):
    """Not undone it is a lean of the rotors, of the same angles, and hides the wind."""
    effects = {e["name"]: e for e in told["effects"]}
    found = effects["mount_tilt"]
    assert found["level"] == "sensor"
    for axis, angle in TURNED.items():
        assert found["values"][axis]["real"] == pytest.approx(angle, abs=0.03)
    assert "wind" in effects
    assert set(effects) <= {"mount_tilt", "gps_latency", "wind", "turbulence"}


def test_what_no_model_describes_is_a_share_of_the_flight(told):
    """The gust is six seconds of it, which are in one block or two of twelve."""
    share = told["unexplained_share"]
    assert 6.0 / told["flight_s"] <= share + 0.02 < 26.0 / told["flight_s"]
    assert f"{100.0 * share:.0f} % of the flight is not explained" in told["note"]
    assert told["verdict"] == "partly_explained"


def test_an_outage_of_the_outputs_is_said_to_be_left_out(told):
    assert "outputs are missing for 6 s" in told["note"]
