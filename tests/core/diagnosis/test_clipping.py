"""An accelerometer at the rail of its range, and all that is none."""

import numpy as np
import pytest

from onboard.core.diagnosis.clipping import cut_off, saturation_effect
from onboard.core.diagnosis.limits import FEWEST_CLIPPED
from onboard.core.inputs.samples import Vibration
from onboard.core.inputs.streams import Streams
from tests.core.diagnosis.flights import G, batches, flown, resting

T0 = 100.0
RATE = 50.0
LIMIT = 2.5 * G


def burst(raw, axis, size, *spans):
    """Adds ``size`` to an axis from and to these times, s since the first sample."""
    out = raw.copy()
    for a, b in spans:
        out[round(a * RATE) : round(b * RATE), axis] += size
    return out


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("limit", [LIMIT, 4.0 * G])
def test_a_rail_is_found_with_its_axis_its_limit_and_its_times(axis, sign, limit):
    rng = np.random.default_rng([axis, int(limit)])
    spans = [(12.0, 12.6), (31.0, 31.8)]
    raw = burst(flown(rng, 60.0), axis, sign * 80.0, *spans)
    clipped = np.clip(raw, -limit, limit)
    found = saturation_effect(batches(clipped), T0)
    assert found.unknowns["limit"].value == pytest.approx(limit)
    assert len(found.intervals) == 2
    for (a, b), (begin, end) in zip(found.intervals, spans, strict=True):
        assert (a, b) == pytest.approx((begin, end - 1.0 / RATE), abs=1e-6)
    assert {w.axis for w in found.where} == {f"body_{'xyz'[axis]}"}
    assert found.share_of_mismatch == pytest.approx(70 / (60.0 * RATE), rel=0.1)


def test_the_axis_is_the_bodys_where_the_board_is_turned():
    """Sensor x is body y: a board turned by 90 degrees."""
    R_bs = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    raw = burst(flown(np.random.default_rng(3), 40.0), 0, 80.0, (20.0, 20.8))
    found = saturation_effect(batches(np.clip(raw, -LIMIT, LIMIT), R_bs=R_bs), T0)
    assert {w.axis for w in found.where} == {"body_y"}


def test_two_knocks_of_a_sample_or_two_are_no_rail():
    rng = np.random.default_rng(4)
    knocks = [(5.0 + 3.0 * k, 5.0 + 3.0 * k + 2.1 / RATE) for k in range(8)]
    raw = np.clip(burst(flown(rng, 40.0), 2, 60.0, *knocks), -LIMIT, LIMIT)
    # 16 samples at the rail, but never four on end: nothing of the trajectory is lost.
    assert np.sum(np.abs(raw[:, 2]) >= LIMIT) >= 16
    assert saturation_effect(batches(raw), T0) is None


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("step", [0.0, 1e-3 * G, 1e-2 * G, 0.1])
def test_no_flight_without_a_rail_has_one(seed, step):
    """Streams are quantised: RAW_IMU in mg, others coarser."""
    rng = np.random.default_rng([seed, round(1e4 * step)])
    raw = flown(rng, 60.0)
    if step:
        raw = np.round(raw / step) * step
    assert saturation_effect(batches(raw), T0) is None


@pytest.mark.parametrize("noise", [0.0, 1e-3, 0.01, 0.1])
@pytest.mark.parametrize("step", [1e-3 * G, 1e-2 * G])
@pytest.mark.parametrize("seed", range(4))
def test_standing_is_no_rail_however_still_and_however_coarse(noise, step, seed):
    """The same value again and again, but that of gravity; scales err by 3 %, offsets too."""
    rng = np.random.default_rng(seed)
    raw = resting(rng, 60.0, noise=noise) * rng.uniform(0.98, 1.02, 3)
    raw = np.round((raw + rng.uniform(-0.2, 0.2, 3)) / step) * step
    assert saturation_effect(batches(raw), T0) is None


def test_no_flight_is_no_finding():
    assert saturation_effect([], T0) is None


# -- clipping that the autopilot counts -------------------------------------------------------


def counted(rises, *, seconds=60, base=7):
    """Slow signal: counts at 1 Hz that rise by so much in the second that ends at each time."""
    t = T0 + np.arange(float(seconds + 1))
    counts = np.full(len(t), float(base))
    for at, rise in rises.items():
        counts[at:] += rise
    return {"clipping": (t, counts)}


def softened(rng, spans, peak):
    """A flight whose peaks a low-pass has rounded: no sample stays at one value."""
    raw = flown(rng, 60.0)
    for a, b in spans:
        n = round((b - a) * RATE)
        at = round(a * RATE)
        raw[at : at + n, 1] = peak * np.sin(np.pi * (np.arange(n) + 0.5) / n)
    return raw


def test_counted_clipping_spans_the_reports_between_which_it_rose():
    raw = softened(np.random.default_rng(5), [(20.1, 21.9), (40.1, 40.9)], 30.0)
    slow = counted({21: 30, 22: 12, 41: 8})
    found = saturation_effect(batches(raw, slow=slow), T0)
    assert found.intervals == ((20.0, 22.0), (40.0, 41.0))
    limit = found.unknowns["limit"]
    assert abs(limit.value - 30.0) < 2.0 * limit.sigma
    assert found.share_of_mismatch == pytest.approx(3.0 / 60.0, rel=0.2)
    assert {w.axis for w in found.where} == {"body_y"}


def test_where_samples_are_stuck_whatever_was_counted_goes_with_them():
    """Vibration is cut off long before the mean is at the rail, and a low-pass reports the mean."""
    raw = np.clip(
        burst(flown(np.random.default_rng(8), 60.0), 2, -80.0, (20.2, 20.9)), -LIMIT, LIMIT
    )
    flight = batches(raw, slow=counted({21: 400, 22: 3, 41: 1}))
    found = saturation_effect(flight, T0)
    assert found.unknowns["limit"].value == pytest.approx(LIMIT)
    assert found.intervals == (pytest.approx((20.0, 22.0)), pytest.approx((40.0, 41.0)))
    assert cut_off(batches(raw), T0) == (pytest.approx((20.2, 20.88)),)
    assert cut_off(batches(flown(np.random.default_rng(9), 60.0)), T0) == ()


def test_what_clips_so_seldom_that_no_number_shows_it_may_be_kept():
    """A sample of a thousand reads too little by about the level of the vibration."""
    raw = softened(np.random.default_rng(6), [(20.1, 20.9), (40.1, 40.9)], 30.0)
    slow = counted({21: 3, 22: 12, 41: 400})

    def cut(level):
        shaken = slow["clipping"][0], np.full((61, 3), [0.1 * level, 0.2 * level, level])
        return cut_off(batches(raw, slow=slow | {"vibration": shaken}), T0)

    assert cut(0.002) == (), "400 of 0.002 m/s^2 in a thousand are less than a mm/s^2"
    assert cut(0.05) == ((40.0, 41.0),)
    assert cut(0.2) == ((21.0, 22.0), (40.0, 41.0))
    assert cut(1.0) == ((20.0, 22.0), (40.0, 41.0))
    assert cut_off(batches(raw, slow=slow), T0) == cut(1.0), "nobody says how much it shakes"


@pytest.mark.parametrize("named", [True, False])
def test_a_count_of_another_accelerometer_is_not_this_ones(named):
    """Logs have a record of each, all of one time; telemetry has one message with all of them."""
    streams = Streams()
    t, counts = counted({21: 30, 22: 12})["clipping"]
    for at, count in zip(t.tolist(), counts.astype(int).tolist(), strict=True):
        if named:
            streams.signal(Vibration(at, (1.0, 1.0, 1.0), (count,), 2))
            streams.signal(Vibration(at, (1.0, 1.0, 1.0), (7,), 3))
        else:
            streams.signal(Vibration(at, (1.0, 1.0, 1.0), (7, count, 7)))
    raw = softened(np.random.default_rng(6), [(20.1, 21.9)], 30.0)
    told = {}
    for imu in (1, 2, 3, 4):
        slow = {k: v for k, v in streams.slow_arrays(imu).items() if k == "clipping"}
        told[imu] = saturation_effect(batches(raw, slow=slow), T0)
    assert told[2].intervals == ((20.0, 22.0),)
    assert told[1] is told[3] is told[4] is None


def test_counts_from_before_the_flight_single_knocks_and_reboots_are_none():
    raw = flown(np.random.default_rng(7), 60.0)

    def found(rises):
        return saturation_effect(batches(raw, slow=counted(rises)), T0)

    assert found({}) is None
    assert found({30: 400}) is None  # one knock, however hard
    assert found(dict.fromkeys(range(10, 50), FEWEST_CLIPPED - 1)) is None
    assert found({30: -7}) is None  # counts begin anew
    assert found({20: FEWEST_CLIPPED, 40: FEWEST_CLIPPED}) is not None


def test_reports_that_two_batches_share_are_counted_once():
    raw = softened(np.random.default_rng(8), [(9.5, 11.0)], 30.0)
    t, counts = counted({10: 20, 11: 20})["clipping"]
    slow = {"clipping": (t + 0.1, counts)}
    flight = batches(raw, slow=slow, length_s=2.0)
    seen = np.concatenate([b.segment.slow["clipping"][0] for b in flight])
    assert len(np.unique(seen)) < len(seen)
    assert saturation_effect(flight, T0).intervals == (pytest.approx((9.1, 11.1)),)
