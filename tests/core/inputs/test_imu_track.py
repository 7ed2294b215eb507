"""What was measured is found again from samples, whatever made them, and whatever changed when."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.inputs.samples import ImuSample, ImuSource
from onboard.core.inputs.tracks import ImuTrack
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.board_orientation import board_rotation

STEP = 9.80665e-3
OTHER = SixParameters((1.02, 0.97, 1.01), (0.1, -0.2, 0.3))
YAW_90 = board_rotation(2.0)


def corrected(raw, six, R_bs):
    """As an autopilot reports it: ``R (raw - offset) * scale``."""
    f = (np.asarray(raw) - np.array(six.offset)) * np.array(six.scale)
    return f if R_bs is None else R_bs @ f


def sample(t, raw, six, R_bs, step=0.0):
    f = corrected(raw, six, R_bs)
    if step:
        f = np.trunc(f / step) * step
    return ImuSample(t, 1, tuple(f.tolist()), (0.1, -0.2, 0.3), 41.0, step, 0.0, ImuSource.RAW_IMU)


@pytest.mark.parametrize("dropped", [0, 3, 5, 7, 10, 13, 15])
def test_raw_is_raw_through_every_change(dropped):
    rng = np.random.default_rng(1)
    raw = rng.uniform(-20.0, 20.0, (15, 3))
    manners = [(SixParameters(), None)] * 5 + [(OTHER, None)] * 5 + [(OTHER, YAW_90)] * 5
    track = ImuTrack()
    for k, (x, (six, R_bs)) in enumerate(zip(raw, manners, strict=True)):
        assert track.add(sample(float(k), x, six, R_bs), six, R_bs)
    track.drop_before(float(dropped))
    t, rows = track.arrays()
    assert t.tolist() == [float(k) for k in range(dropped, 15)]
    np.testing.assert_allclose(rows[:, 3:6], raw[dropped:], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(rows[:, 6], 41.0)
    # What comes after a drop is undone in its own manner, too.
    track.add(sample(20.0, raw[0], OTHER, None), OTHER, None)
    np.testing.assert_allclose(track.arrays()[1][-1, 3:6], raw[0], rtol=1e-12)


def test_a_report_of_the_same_parameters_changes_nothing():
    track, same = ImuTrack(), SixParameters(OTHER.scale, OTHER.offset)
    for k, six in enumerate((OTHER, same, OTHER, same)):
        track.add(sample(float(k), (1.0, 2.0, -9.0), six, None, STEP), six, None)
    assert len(track._manners) == 1
    np.testing.assert_allclose(track.arrays()[1][:, 3:6], [(1.0, 2.0, -9.0)] * 4, atol=STEP)


def test_arrays_of_before_stay_as_they_were():
    track = ImuTrack()
    track.add(sample(0.0, (1.0, 2.0, 3.0), OTHER, None), OTHER, None)
    _, rows = track.arrays()
    before = rows.copy()
    track.add(sample(1.0, (4.0, 5.0, 6.0), OTHER, None), OTHER, None)
    assert len(track.arrays()[1]) == 2
    np.testing.assert_array_equal(rows, before)
    with pytest.raises(ValueError, match="read-only"):
        rows[0, 0] = 0.0


def test_temperature_is_that_of_the_coarser_samples_where_the_finer_ones_tell_none():
    """ArduPilot's HIGHRES_IMU has the barometer's, RAW_IMU and SCALED_IMU2 the accelerometer's."""
    track, same = ImuTrack(), SixParameters()
    for k in range(1000):
        t, celsius = 0.02 * k, 30.0 + 0.001 * k
        coarse = sample(t, (0.0, 0.0, -9.8), same, None, STEP)
        coarse = replace(coarse, temperature=celsius if k < 800 else None)
        fine = replace(coarse, t=t + 1e-4, temperature=None, source=ImuSource.HIGHRES_IMU)
        assert track.add(coarse, same, None) is (k == 0 or k < 100)
        if k >= 99:
            assert track.add(fine, same, None)
    t, rows = track.arrays()
    for first, last in ((0.0, 1.9), (0.5, 10.0), (5.0, 15.0), (10.0, 17.9)):
        part = (t >= first) & (t <= last)
        times, warm = track.warmth(t[part], rows[part, 6])
        np.testing.assert_allclose(warm, 30.0 + 0.05 * times, atol=1e-6)
        assert times[0] < first + 0.1
        assert times[-1] > last - 2.2, "of ten samples one"
    silent = t > 12.0
    assert track.warmth(t[silent], rows[silent, 6]) is None, "for too long nobody has told it"
    track.drop_before(10.0)
    assert track.beside.first > 9.0


def test_a_sensor_that_warms_up_through_zero_keeps_its_temperature():
    """Zero means unknown; that of the samples beside them is that of these, too."""
    track, same = ImuTrack(), SixParameters()
    for k in range(1000):
        celsius = round(-2.0 + 0.005 * k, 2)
        told = replace(sample(0.02 * k, (0.0, 0.0, -9.8), same, None), temperature=celsius or None)
        assert track.add(told, same, None)
    t, rows = track.arrays()
    assert np.isnan(rows[:, 6]).any()
    times, warm = track.warmth(t, rows[:, 6])
    np.testing.assert_allclose(warm, -2.0 + 0.25 * times, atol=6e-3)
    assert times[0] == t[0]
    assert times[-1] > t[-1] - 0.5
    assert track.warmth(t, np.full(len(t), np.nan)) is None, "a sensor without a thermometer"
