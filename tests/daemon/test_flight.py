"""The daemon against the built-in autopilot over real UDP: it flies, learns, lands, writes."""

import numpy as np
import pytest

from onboard.answers.replay import read
from onboard.core.estimate.calibrator import Calibrator
from tests.daemon.daemons import held_back, until
from tests.daemon.flights import SPEEDUP, TRUE_SIX, GroundStation, flying, level_error, six

pytestmark = pytest.mark.virtual_time


@pytest.fixture
def in_a_hurry(document, tmp_path):
    """A short flight cannot show everything as well as the default policy wants to know it."""
    document["recording"] = {"enabled": True, "directory": str(tmp_path / "recordings")}
    return document


@pytest.mark.slow
async def test_it_flies_calibrates_lands_pushes_and_reads_back(in_a_hurry, daemon, port, tmp_path):
    async with daemon(in_a_hurry) as service, flying(port) as (autopilot, _, station_port):
        # A list of parameters is read in real time, however fast the rest is.
        autopilot.parameters.load({"SIM_SPEEDUP": 1.0})
        await until(lambda: service.parts.parameters.complete)
        autopilot.parameters.load({"SIM_SPEEDUP": SPEEDUP})
        await until(lambda: autopilot.flying)
        await until(lambda: service.snapshot().imus)
        # A ground station changes a parameter in the middle of the window: sums are raw.
        station = GroundStation(station_port)
        station.set("INS_ACCOFFS_X", 0.5)
        await until(lambda: service.snapshot().parameters["INS_ACCOFFS_X"] == 0.5)
        station.close()
        before = six(autopilot)
        assert before[3] == 0.5
        await until(lambda: not autopilot.flying)
        assert np.array_equal(six(autopilot), before), "nothing may be written in flight"
        # On the ground there is nothing to hurry for, and much to learn from what was flown.
        autopilot.parameters.load({"SIM_SPEEDUP": 1.0})
        await until(lambda: "unconfirmed" in held_back(service), limit=400.0)
        why = held_back(service)["unconfirmed"]
        assert "INS_ACCOFFS_X" in why, "what somebody has set is not overwritten unasked"
        await service.approve((1,))
        await until(lambda: service.snapshot().push.can_roll_back == (1,), limit=400.0)
        assert service.snapshot().diagnosis["verdict"] in {"clean", "explained"}
        await until(lambda: service.handover._busy_since is None, limit=400.0)

        imu = service.handover.learned.calibrations[1]
        estimate = np.array(imu.scale + imu.offset)
        sigma = np.array(imu.scale_sigma + imu.offset_sigma)
        error = estimate - TRUE_SIX
        assert np.all(np.abs(error) < 4.0 * sigma)
        assert np.all(np.abs(error[:3]) < 0.01)
        assert np.all(np.abs(error[3:5]) < 0.05)
        # z scale and offset of a short flight are known better together than each by itself.
        assert abs(level_error(estimate)) < 0.05
        # What the autopilot has now is what was proposed, and better than what it had.
        planned = service.parts.journal.last_completed(1).plan
        assert six(autopilot) == pytest.approx(list(planned.wanted.values()), abs=1e-7)
        pushed_error = six(autopilot) - TRUE_SIX
        assert np.all(np.abs(pushed_error) < 4.0 * sigma)
        baseline = service.parts.journal.last_completed(1).plan.baseline
        assert baseline.held_out_after < baseline.held_out_before
        imu_view = service.snapshot().imus[0]
        assert imu_view.timing["gps_delay_s"].value == pytest.approx(0.12, abs=0.03)

    # The same numbers come out of the recording of the very same stream.
    live = service.handover._learner._calibrator
    live.finish()
    (recording,) = (tmp_path / "recordings").glob("*.tlog")
    calibrator = Calibrator(live.settings)
    read([recording], calibrator)
    again = calibrator.calibration(1)
    now = live.calibration(1)
    assert now.scale == pytest.approx(again.scale, rel=1e-9)
    assert now.offset == pytest.approx(again.offset, rel=1e-9, abs=1e-9)
    assert now.trusted_s == pytest.approx(again.trusted_s)
    assert np.array(now.covariance) == pytest.approx(np.array(again.covariance), rel=1e-6)
