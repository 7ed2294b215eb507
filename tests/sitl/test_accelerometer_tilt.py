"""Advice on a tilted accelerometer, followed on a real ArduPilot: what helps, and what does not.

SIM_ACC_TRIM turns the accelerometers and not the gyroscopes.  Runs with ``--sitl=ardupilot``.
"""

import numpy as np
import pytest

from onboard.core.diagnosis.procedure import diagnose
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.mavlink.decode import Decoder
from sitl import harness
from tests.sitl.listener import Listener

SIMSTATE = {164: 50_000}
TURNED = (0.03, -0.025)
MISTAKEN = (-0.03, 0.024)


@pytest.fixture
def kind(request):
    if request.config.getoption("--sitl") != "ardupilot":
        pytest.skip("the built-in autopilot has no SIM_ACC_TRIM: tests/core/test_mount_tilt.py")
    reason = harness.unavailable("ardupilot", "copter")
    if reason:
        pytest.skip(reason)
    return "ardupilot"


def pair(name, angles):
    return {f"{name}_{axis}": value for axis, value in zip("XY", angles, strict=True)}


async def flown(kind, **parameters):
    """Tilts that a flight is diagnosed with; roll and pitch of ATTITUDE less the true ones, rad."""
    listener = Listener(SIMSTATE)
    async with (
        harness.simulator(kind, "copter", speedup=5.0, parameters=parameters) as sitl,
        listener.at(sitl.endpoint),
    ):
        await listener.ask()
        await sitl.fly(150.0)
        # While it manoeuvres: both come evenly, and the EKF has learned what it can.
        flight = listener.messages[len(listener.messages) // 3 :]
        await sitl.land()
    reported, true = (
        np.mean([(m.roll, m.pitch) for m in flight if m.get_type() == name], axis=0)
        for name in ("ATTITUDE", "SIMSTATE")
    )
    decoder, made = Decoder(), Calibrator(CalibratorSettings(buffer_s=3600.0, refine=False))
    for message in listener.messages:
        for sample in decoder.decode(message):
            made.feed(sample)
    made.finish()
    found = diagnose(made, 1)
    off = reported - true
    tilts = [e for e in found.effects if e.name == "mount_tilt"]
    said = [(e.name, {k: round(q.value, 4) for k, q in e.unknowns.items()}) for e in found.effects]
    print(f"ATTITUDE off by {off.round(4)} rad; {found.verdict.value}: {said}")
    for tilt in tilts:
        print(tilt.cure, tilt.parameters)
    return tilts, off


@pytest.mark.slow
async def test_the_advice_on_a_tilted_accelerometer_helps(kind):
    turned = pair("SIM_ACC_TRIM", TURNED)
    (tilt,), off = await flown(kind, **turned)
    assert tilt.unknowns["roll"].value == pytest.approx(-TURNED[0], abs=0.006)
    assert tilt.unknowns["pitch"].value == pytest.approx(-TURNED[1], abs=0.006)
    assert tilt.parameters == {}
    assert np.abs(off).max() < 0.012

    (tilt,), off = await flown(kind, **turned, **pair("AHRS_TRIM", MISTAKEN))
    assert off == pytest.approx(-np.array(MISTAKEN), abs=0.012)
    assert tilt.parameters == {"AHRS_TRIM_X": 0.0, "AHRS_TRIM_Y": 0.0}

    (tilt,), off = await flown(kind, **turned, **tilt.parameters)
    assert tilt.parameters == {}
    assert np.abs(off).max() < 0.012

    tilts, off = await flown(kind)  # the sensor is replaced
    assert tilts == []
    assert np.abs(off).max() < 0.012
