"""What the messages mean is told by parameters: nothing is learned before they are known."""

from types import SimpleNamespace

import pytest

from onboard.core.estimate.settings import CalibratorSettings
from onboard.daemon.learning.handover import Handover
from onboard.daemon.learning.identity import Identity
from onboard.daemon.learning.learner import Learner
from onboard.daemon.learning.store import Store
from onboard.daemon.view.notices import Notices
from onboard.mavlink.codec import Codec
from onboard.mavlink.decode import Decoder
from sitl.recording import FlightSpec, fly

MEANING = {"INS_ACCEL_FILTER": 5.0, "AHRS_TRIM_X": 0.03, "AHRS_TRIM_Y": -0.04}


@pytest.fixture(scope="module")
def flight():
    """(seconds, message) of a flight whose autopilot filters slowly and is trimmed."""
    codec = Codec()
    frames = fly(FlightSpec(vehicle="copter", duration=60.0, parameters=MEANING))
    return [
        (1e-6 * (unix_us - frames[0][0]), frame.message)
        for unix_us, raw in frames
        for frame in codec.feed(raw)
        if frame.message is not None
    ]


def late(message):
    return message.get_type() == "PARAM_VALUE" and message.param_id in MEANING


async def learned(flight, directory, *, told_at):
    """What is learned where some parameters come not before ``told_at`` (s)."""
    now, there = (
        0.0,
        SimpleNamespace(identity=Identity(1), introduced=False, judging=(), in_flight=False),
    )
    learning = Handover(
        Learner(Store(directory), CalibratorSettings(), clock=lambda: now, wall_clock=lambda: now),
        Notices(lambda: now),
        there=there,
        clock=lambda: now,
        wall_clock=lambda: now,
        save_every_s=1e9,
    )
    learning.decoder = Decoder(1, 1)
    held = [m for t, m in flight if late(m)]
    due = 1.0
    for now, message in flight:
        if not there.introduced and now >= told_at:
            there.introduced = True
            for parameter in held:
                learning.take(parameter)
        if not late(message):
            learning.take(message)
        if now >= due:
            due += 1.0
            await learning.step()
    await learning.step()
    return learning.learned.calibrations[1]


@pytest.mark.slow
async def test_what_came_before_the_parameters_is_learned_as_they_say(flight, tmp_path):
    at_once = await learned(flight, tmp_path / "1", told_at=6.0)
    later = await learned(flight, tmp_path / "2", told_at=25.0)
    assert later.scale == pytest.approx(at_once.scale, rel=1e-9)
    assert later.offset == pytest.approx(at_once.offset, rel=1e-9, abs=1e-9)
    assert later.trusted_s == pytest.approx(at_once.trusted_s)


@pytest.mark.slow
async def test_parameters_that_never_come_are_not_waited_for_for_ever(
    flight, tmp_path, monkeypatch
):
    monkeypatch.setattr("onboard.daemon.learning.limits.PARAMETERS_S", 5.0)
    without = await learned(flight, tmp_path, told_at=1e9)
    assert without.trusted_s > 30.0
