"""Of flight whose commands, or airspeed, were not recorded for a while nothing is told."""

import numpy as np
import pytest

from onboard.answers.match_left_out import of_velocity
from onboard.core.vehicle.flight import flight_of
from onboard.core.vehicle.limits import STEP_S
from onboard.core.vehicle.signals import Signals, Stream
from onboard.core.vehicle.trajectory import Motion

T = np.arange(0.0, 60.0, 0.02)
HOLE = (20.0, 29.0)


def motion(**change):
    """A minute of level flight."""
    n = len(T)
    return Motion(
        T,
        np.tile([0.0, 0.0, -9.8], (n, 1)),
        np.zeros((n, 3)),
        np.tile(np.eye(3), (n, 1, 1)),
        np.tile([20.0, 0.0, 0.0], (n, 1)),
        np.full(n, 650.0),
        0.05,
        1e-3,
        **change,
    )


def stream(width, *, holed=False):
    t = np.arange(0.0, 60.0, 0.1)
    t = t[(t < HOLE[0]) | (t > HOLE[1])] if holed else t
    return Stream(t, np.full((len(t), width), 0.5))


def flown(kind, commands, airspeed=Stream()):  # noqa: B008 - it never changes
    signals = Signals(airspeed=airspeed, battery=stream(2, holed=True), kind=kind)
    return flight_of([motion()], signals, commands, [], 580.0)


@pytest.mark.parametrize(
    ("kind", "commands", "airspeed"),
    [
        ("copter", stream(3, holed=True), Stream()),
        ("plane", stream(2, holed=True), stream(1)),
        ("plane", stream(2), stream(1, holed=True)),
    ],
)
def test_steps_in_an_outage_are_no_flight(kind, commands, airspeed):
    flight = flown(kind, commands, airspeed)
    inside = (flight.t > HOLE[0]) & (flight.t < HOLE[1])
    assert not inside.any()
    assert flight.unheard_s == pytest.approx(np.diff(HOLE)[0], abs=3 * STEP_S)
    assert len(flight) * STEP_S == pytest.approx(60.0 - flight.unheard_s, abs=2 * STEP_S)
    # The noise's memory does not reach across, the servos' does.
    assert list(np.unique(flight.piece)) == [0, 1]
    assert len(flight.history.commands) == pytest.approx(60.0 / STEP_S, abs=2)


def test_steps_whose_velocity_nobody_knows_are_no_flight():
    """No receiver held it for nine seconds: what is left of a force there is of no air."""
    lost = (HOLE[0] < T) & (HOLE[1] > T)
    signals = Signals(airspeed=stream(1), kind="plane")
    flight = flight_of([motion(lost=lost)], signals, stream(2), [], 580.0)
    assert not ((flight.t > HOLE[0]) & (flight.t < HOLE[1])).any()
    assert flight.lost_s == pytest.approx(np.diff(HOLE)[0], abs=3 * STEP_S)
    assert flight.unheard_s == 0.0
    assert len(flight) * STEP_S == pytest.approx(60.0 - flight.lost_s, abs=2 * STEP_S)
    assert "nobody knows the velocity for 9 s" in of_velocity(flight)
    assert of_velocity(flown("plane", stream(2))) == ""


@pytest.mark.parametrize("kind", ["copter", "plane"])
def test_what_is_not_needed_or_hardly_there_costs_no_flight(kind):
    """A voltage changes slowly; commands of a tenth of the flight are none, and it is lateral."""
    little = Stream(np.arange(0.0, 6.0, 0.1), np.full((60, 3), 0.5))
    for commands in (stream(3), little, Stream()):
        flight = flown(kind, commands)
        assert flight.unheard_s == 0.0
        assert len(flight) * STEP_S == pytest.approx(60.0, abs=2 * STEP_S)
    assert flown(kind, little).commands.shape[1] == 0
