"""Loops of the simulated autopilot in which nothing is to be done: all is sent as without them."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl import recording
from sitl.builtin.autopilot import Autopilot
from sitl.builtin.truth import ImuTruth, Truth
from sitl.recording import FlightSpec


def told():
    """All that a client hears of a vehicle that is asked, moved, switched off and started again."""
    autopilot = Autopilot("copter", Truth(imus=(ImuTruth(), ImuTruth()), seed=4))
    link = autopilot.connect()
    heard = []
    for turn in range(3):
        autopilot.advance(3.003)
        autopilot.links.set_rate(link, "RAW_IMU", 30.0 + 40.0 * turn)
        autopilot.links.request_parameters(link)
        autopilot.parameters.set(autopilot.now, "SIM_ACC1_BIAS_X", 0.1 * turn)
        autopilot.advance(6.0)
        autopilot.arm(force=True)
        autopilot.take_off(8.0)
        autopilot.advance(10.0)
        if autopilot.power_cycle(0.37 * turn):
            heard.append((autopilot.clock, "off"))
        packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        heard += [(t, bytes(message.pack(packer))) for t, message in link.outbox]
        link.outbox.clear()
    return heard, autopilot.clock


def every_loop(monkeypatch):
    monkeypatch.setattr(Autopilot, "_idle", lambda *_: None)


def test_a_client_hears_the_same_at_the_same_times(monkeypatch):
    skipping = told()
    every_loop(monkeypatch)
    looping = told()
    assert any(what == "off" for _, what in skipping[0])
    assert looping == skipping


@pytest.mark.parametrize(("vehicle", "loop_rate"), [("copter", 400), ("plane", 50)])
def test_a_recording_is_the_same_to_the_byte(monkeypatch, vehicle, loop_rate):
    spec = FlightSpec(vehicle=vehicle, duration=25.0, seed=2, loop_rate=loop_rate)
    skipping = recording.fly(spec)
    every_loop(monkeypatch)
    assert recording.fly(spec) == skipping


def test_most_loops_are_skipped(monkeypatch):
    """Else there is no use in looking for them."""
    autopilot, gone = Autopilot("copter", Truth()), []
    autopilot.connect()
    loop = Autopilot._loop
    monkeypatch.setattr(Autopilot, "_loop", lambda self: (gone.append(self.now), loop(self)))
    autopilot.advance(10.0)
    assert len(gone) < 0.5 * 10.0 * 400.0
