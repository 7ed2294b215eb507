"""A plane with upright rotors: its wings are told by flight in which those stand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from onboard.answers import match as match_module
from onboard.core.vehicle.contradiction import Contradiction
from onboard.core.vehicle.lift_rotors import RUN_DOWN_S, carried, on_wings, unseen
from onboard.core.vehicle.signals import Signals, Stream
from onboard.errors import RecordingError
from tests.core.vehicle.flights import STEP, plane_flight, smooth
from tests.core.vehicle.planes import SIGMA, matched, names

FUNCTIONS = {
    **{f"SERVO{k + 5}_FUNCTION": 33.0 + k for k in range(4)},
    "SERVO3_FUNCTION": 70.0,
    "Q_ENABLE": 1.0,
}
HOVER = (70.0, 130.0)
"""s, on the flight's clock, in which rotors carry it."""
HEAVY = {"c_lift_0": 0.4, "c_lift_a": 5.0, "c_y_b": -0.5}
TOLD = {"lift.c_lift_0": 0.4, "lift.c_lift_a": 5.0, "side_force.c_y_b": -0.5}
MOSTLY = (80.0, 215.0)
"""The same of a flight that is more of a hover."""


def spinning(flight, *spans, parameters=FUNCTIONS, idle=1000.0):
    """What a recording says of a plane whose four rotors turn in these spans."""
    t = np.arange(flight.t[0], flight.t[-1], STEP)
    outputs = np.full((len(t), 8), 1500.0)
    outputs[:, 4:] = idle
    for start, end in spans:
        at = (t >= start) & (t <= end)
        outputs[at, 4:] = np.linspace(1250.0, 1600.0, 4)
    return Signals(outputs=Stream(t, outputs), parameters=parameters, kind="plane")


def lifted(flight, start, end):
    """The same flight, carried in part by rotors from start to end, which the model has not got."""
    at = (flight.t >= start) & (flight.t <= end)
    rng = np.random.default_rng(5)
    pull = np.where(at, 5.0 + smooth(rng, len(flight), 1.0), 0.0)
    f_b = flight.f_b.copy()
    f_b[:, 2] -= pull
    # They lean with the vehicle, and hold it against the air.
    f_b[:, :2] -= 0.05 * pull[:, None] * flight.v_b[:, :2] / 10.0
    return replace(flight, f_b=f_b)


def test_the_tail_servo_of_three_rotors_turns_none_of_them():
    """It stands in the middle all flight long, with the number of a motor."""
    flight = plane_flight(seconds=60.0)
    three = {n: f for n, f in FUNCTIONS.items() if f != 35.0}
    three |= {"SERVO4_FUNCTION": 39.0, "Q_FRAME_CLASS": 7.0}
    assert not carried(flight, spinning(flight, parameters=three)).any()


def test_what_rotors_carry_is_left_out_with_the_time_in_which_they_run_up_and_down():
    flight = plane_flight(seconds=120.0)
    mask = carried(flight, spinning(flight, HOVER))
    assert mask[(flight.t > HOVER[0]) & (flight.t < HOVER[1])].all()
    start, end = flight.t[mask][[0, -1]]
    assert start == pytest.approx(HOVER[0] - RUN_DOWN_S, abs=2 * STEP)
    assert end == pytest.approx(HOVER[1] + RUN_DOWN_S, abs=2 * STEP)
    wings, seconds = on_wings(flight, spinning(flight, HOVER))
    assert seconds == pytest.approx(np.count_nonzero(mask) * STEP)
    # The memory of noise does not reach over what is left out.
    assert list(np.unique(wings.piece)) == [0, 1]


@pytest.mark.parametrize("idle", [0.0, 1000.0, 1040.0])
def test_rotors_that_stand_or_idle_carry_nothing(idle):
    flight = plane_flight(seconds=60.0)
    assert on_wings(flight, spinning(flight, idle=idle)) == (flight, 0.0)


def test_a_plane_without_rotors_is_on_its_wings():
    flight = plane_flight(seconds=60.0)
    for signals in (Signals(kind="plane"), spinning(flight, HOVER, parameters={})):
        assert on_wings(flight, signals) == (flight, 0.0)
        assert not unseen(signals)


@pytest.mark.parametrize("tilts", ["Q_TILT_ENABLE", "Q_TAILSIT_ENABLE"])
def test_rotors_that_tilt_do_not_tell_when_they_carry(tilts):
    flight = plane_flight(seconds=60.0)
    signals = spinning(flight, HOVER, parameters={**FUNCTIONS, tilts: 1.0})
    assert on_wings(flight, signals) == (flight, 0.0)
    assert not unseen(signals)


@pytest.mark.slow
def test_a_hover_between_is_no_other_wing():
    flight = lifted(plane_flight(seed=1, wind=(2.0, -3.0), **HEAVY), *MOSTLY)
    match = matched(on_wings(flight, spinning(flight, MOSTLY))[0])
    assert names(match) == {"wind", "lift", "side_force"}
    assert match.explained
    told = {"wind.north": 2.0, "wind.east": -3.0} | TOLD
    for key, truth in told.items():
        assert abs(match.numbers[key].real - truth) < 4.0 * match.numbers[key].sigma
        assert match.numbers[key].sigma < 0.1
    # Where rotors are taken for wings, what they do hides what these do.
    assert "lift" not in names(matched(flight))


@pytest.fixture
def level(monkeypatch):
    """The vehicle level of a flight with such outputs."""
    flights = {}

    def recording(flight, signals) -> Any:
        name = f"{len(flights)}.BIN"
        flights[name] = flight
        return SimpleNamespace(
            signals=signals,
            batches=name,
            sensors=SimpleNamespace(force_sigma=SIGMA),
            grounded=(),
            ground=580.0,
            disagreement=None,
            derived=True,
            name=name,
        )

    monkeypatch.setattr(match_module, "motions", lambda batches, _: [batches])
    monkeypatch.setattr(match_module, "flight_of", lambda pieces, *_: flights[pieces[0]])
    monkeypatch.setattr(match_module, "contradiction", lambda _: Contradiction())
    monkeypatch.setattr(match_module, "match_plane", lambda flight, *_: told(flight))

    def ask(flight, signals, *others):
        return match_module.vehicle_level(
            recording(flight, signals), {}, [recording(*other) for other in others]
        )

    return ask


def told(flight) -> Any:
    return match_module.VehicleMatch("plane", note=f"{len(flight)} steps")


def test_it_is_said_how_long_rotors_carried_it(level):
    flight = plane_flight(seconds=120.0)
    note = level(flight, spinning(flight, HOVER)).note
    wings, seconds = on_wings(flight, spinning(flight, HOVER))
    left_out = f"upright rotors turned for {seconds:.0f} s, of which nothing is told"
    assert note == f"{len(wings)} steps; {left_out}"
    assert level(flight, spinning(flight)).note == f"{len(flight)} steps"


def test_of_a_hover_and_of_rotors_that_nobody_saw_nothing_is_told(level):
    flight = plane_flight(seconds=60.0)
    hover = spinning(flight, (0.0, 1e3))
    blind = Signals(parameters=FUNCTIONS, kind="plane")
    assert level(flight, hover).note == match_module.CARRIED
    assert level(flight, blind).note == match_module.UNSEEN
    good = spinning(flight)
    for signals, why in ((hover, match_module.CARRIED), (blind, match_module.UNSEEN)):
        with pytest.raises(RecordingError, match=why):
            level(flight, good, (flight, signals))
