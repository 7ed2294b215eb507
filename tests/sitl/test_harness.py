"""Both simulators behind one interface: the same flight, the same physics.

Runs with ``--sitl=builtin`` (the default) or ``--sitl=ardupilot``.
"""

import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Status
from onboard.mavlink.decode import Decoder
from sitl import harness
from sitl.ardupilot import process
from sitl.errors import NoBinaryError
from tests.sitl.listener import Listener

pytestmark = pytest.mark.virtual_time
SCALE, OFFSET = (1.02, 0.98, 1.015), (0.2, -0.15, 0.25)


@pytest.fixture(params=["copter", "plane"])
def vehicle(request):
    return request.param


@pytest.fixture
def kind(request, vehicle):
    chosen = request.config.getoption("--sitl")
    reason = harness.unavailable(chosen, vehicle)
    if reason:
        pytest.skip(reason)
    return chosen


@pytest.mark.slow
async def test_flies_lands_and_gives_its_truth_away(kind, vehicle):
    """An estimate from what the vehicle sends is the truth that it was given."""
    async with harness.simulator(kind, vehicle, speedup=15 if kind == "builtin" else 6) as sitl:
        await sitl.set_truth(1, scale=SCALE, offset=OFFSET)
        assert await sitl.parameter("SIM_ACC1_SCAL_Y") == pytest.approx(SCALE[1])
        listener = Listener()
        async with listener.at(sitl.endpoint):
            await listener.ask()
            await sitl.fly(140.0 if kind == "builtin" else 200.0)
            await sitl.land()
    decoder, calibrator = Decoder(), Calibrator()
    for message in listener.messages:
        for sample in decoder.decode(message):
            calibrator.feed(sample)
    calibrator.finish()
    result = calibrator.calibration(1)
    assert result.status is Status.CALIBRATED
    errors = [e - t for e, t in zip(result.scale + result.offset, SCALE + OFFSET, strict=True)]
    bounds = [0.01] * 3 + [0.03, 0.03, 0.06]
    sigmas = result.scale_sigma + result.offset_sigma
    for error, bound, sigma, seen in zip(errors, bounds, sigmas, result.observable, strict=True):
        # A coordinated turn shows little of the y scale; then it must say so.
        assert abs(error) < bound or not seen
        assert abs(error) < 4.0 * sigma
    assert sum(result.observable) >= 5


def test_no_binary_is_said_with_the_places_looked_at(monkeypatch, tmp_path):
    monkeypatch.setenv("ARDUPILOT_SITL_DIR", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(NoBinaryError, match="ARDUPILOT_SITL_DIR"):
        process.find_binary("copter")
    assert "arduplane" in harness.unavailable("ardupilot", "plane")
    assert harness.unavailable("builtin", "plane") is None


def test_binary_in_the_folder_comes_before_the_path(monkeypatch, tmp_path):
    for place in ("folder", "path"):
        (tmp_path / place).mkdir()
        binary = tmp_path / place / "arducopter"
        binary.write_text("")
        binary.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    monkeypatch.setenv("ARDUPILOT_SITL_DIR", str(tmp_path / "folder"))
    assert process.find_binary("copter").parent.name == "folder"
    monkeypatch.delenv("ARDUPILOT_SITL_DIR")
    assert process.find_binary("copter").parent.name == "path"
