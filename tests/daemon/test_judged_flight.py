"""Which flights take away what an earlier one has shown."""

import pytest

from onboard.core.estimate.result import Status
from onboard.daemon.learning.flight import Judged, JudgedFlight
from onboard.push.diagnosed import Diagnosed
from tests.daemon.daemons import calibration


@pytest.mark.parametrize(
    ("verdict", "status", "missing", "nothing"),
    [
        ("insufficient", Status.INSUFFICIENT, "", True),
        ("explained", Status.INSUFFICIENT, "", True),  # a hover that shows a late receiver
        ("clean", Status.CALIBRATED, "", False),
        ("partly_explained", Status.INSUFFICIENT, "the residual is not noise", False),
    ],
)
def test_a_flight_that_neither_calibrates_nor_doubts_says_nothing(
    verdict, status, missing, nothing
):
    found = Diagnosed(1, verdict, (), calibration(status=status), missing)
    flight = JudgedFlight(None, {1: Judged(1.0, (1.0,) * 3 + (0.0,) * 3, found)})
    assert flight.says_nothing is nothing


def judged(verdict, *, effects=(), missing="", blind=(), status=Status.CALIBRATED):
    document = {"not_testable": [{"name": name, "why": "a hover"} for name in blind]}
    found = Diagnosed(1, verdict, effects, calibration(status=status), missing, document=document)
    return JudgedFlight(None, {1: Judged(1.0, (1.0,) * 3 + (0.0,) * 3, found)})


ANTENNA = judged("explained", effects=("gps_lever_arm", "gps_latency"), missing="set GPS1_POS_X")
JUMP = judged("explained", effects=("bias_step",), missing="inspect the mount")


@pytest.mark.parametrize(
    ("later", "overrules"),
    [
        (judged("clean"), True),
        (judged("explained", effects=("gps_latency",), blind=("gps_lever_arm",)), False),
        (judged("explained", effects=("gps_latency",), blind=("gps_latency",)), True),
        (judged("insufficient"), False),  # a hover: calibrated, and blind
        (judged("explained", effects=("gps_lever_arm",), missing="set it", blind=("a",)), True),
    ],
)
def test_what_a_flight_cannot_see_is_not_gone_with_it(later, overrules):
    assert (later.after(ANTENNA) == later) is overrules


def test_what_held_for_one_flight_is_gone_with_it():
    assert judged("clean", blind=("bias_step",)).after(JUMP) is not None


def test_a_hover_after_a_flight_that_lacked_nothing_counts():
    assert judged("insufficient").after(judged("clean")) is not None


def test_what_one_accelerometer_shows_is_not_lost_with_what_another_cannot():
    """The second is withheld for what this flight could not show; the first has jumped since."""
    before = JudgedFlight(None, {1: judged("clean").imus[1], 2: ANTENNA.imus[1]})
    blind = judged("insufficient", blind=("gps_lever_arm",)).imus[1]
    taken = JudgedFlight(None, {1: JUMP.imus[1], 2: blind}).after(before)
    assert taken is not None
    assert taken.imus == {1: JUMP.imus[1], 2: ANTENNA.imus[1]}
