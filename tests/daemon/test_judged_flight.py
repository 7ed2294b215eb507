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
