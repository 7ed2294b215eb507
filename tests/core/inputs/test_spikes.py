"""Single false samples are found where they are; what a vehicle feels is left as it is."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from onboard.core.inputs.limits import (
    LEAST_SPREAD_M_S2,
    NEAR_SAMPLES,
    NEVER_SIGMAS,
    SPREAD_SAMPLES,
)
from onboard.core.inputs.spikes import spikes_of
from onboard.core.maths.medians import NORMAL_MEDIAN
from tests.core.inputs.test_expected_force import STEP, T, batches, felt, manoeuvre

SIZE = 9.8


def shaken(noise, seed=1):
    return manoeuvre() + noise * np.random.default_rng(seed).normal(size=(len(T), 3))


def spiked(raw, *, share=0.01, seed=2):
    """Some samples wrong by a g on all axes, and which."""
    rng = np.random.default_rng(seed)
    wrong = rng.random(len(T)) < share
    return raw + wrong[:, None] * SIZE * rng.choice([-1.0, 1.0], size=raw.shape), wrong


@pytest.mark.parametrize("noise", [0.02, 0.3])
def test_they_are_found_and_the_force_is_there_again(noise):
    raw = shaken(noise)
    read, wrong = spiked(raw)
    found = spikes_of(batches(read))
    its = np.round(found.t / STEP).astype(int)
    assert np.mean(wrong[its]) > 0.98, "a slope beside one may look like one"
    assert len(its) > 0.97 * np.count_nonzero(wrong), "but where two are next to each other"
    assert found.samples == len(T), "each sample counts once, though segments overlap"
    assert np.median(found.size) == pytest.approx(SIZE, rel=0.1)
    left = felt(found.batches) - raw
    assert np.abs(left[~wrong]).max() < 0.5
    assert np.abs(left[its]).max() < 6.0 * noise + 0.4


@pytest.mark.parametrize("noise", [0.0, 0.3, 3.0])
def test_without_them_none_is_found(noise):
    assert spikes_of(batches(shaken(noise))) is None


def test_vibration_that_comes_and_goes_is_none():
    loud = 1.0 + 5.0 * (np.sin(2.0 * np.pi * T / 60.0) > 0.0)[:, None]
    noise = loud * np.random.default_rng(4).normal(size=(len(T), 3))
    assert spikes_of(batches(manoeuvre() + 0.2 * noise)) is None


def test_a_load_that_lasts_is_felt():
    """A tenth of a second of two g is a gust or a landing, and not a single sample."""
    raw = shaken(0.1)
    raw[3000:3005, 2] -= 2.0 * SIZE
    assert spikes_of(batches(raw)) is None


def suspected_one_by_one(x):
    """(n,) by its definition, sample after sample of one axis."""
    n = len(x)
    ends = np.pad(x, 2, mode="reflect", reflect_type="odd")
    fours = [np.sort(ends[[i, i + 1, i + 3, i + 4]]) for i in range(n)]
    far = np.array([abs(x[i] - (f[1] + f[2]) / 2.0) for i, f in enumerate(fours)])
    around = np.empty(n)
    for some in np.array_split(np.arange(n), n // SPREAD_SAMPLES):
        around[some] = np.median(far[some])
    out = np.zeros(n, dtype=bool)
    for i, f in enumerate(fours):
        spread = around[i]
        if NEAR_SAMPLES <= i < n - NEAR_SAMPLES:
            before, after = far[i - NEAR_SAMPLES : i], far[i + 1 : i + 1 + NEAR_SAMPLES]
            spread = max(spread, np.median(before), np.median(after))
        beyond = max(f[1] - x[i], x[i] - f[2], 0.0)
        out[i] = beyond > NEVER_SIGMAS * max(spread / NORMAL_MEDIAN, LEAST_SPREAD_M_S2)
    return out


def test_a_flight_in_parts_is_looked_at_as_the_whole_of_it():
    """Where one part ends and the next begins, and at either end of the flight, too."""
    raw, _ = spiked(shaken(0.3), share=0.02, seed=5)
    raw[[0, 1, -1], 0] += SIZE
    found = spikes_of(batches(raw))
    one_by_one = np.column_stack([suspected_one_by_one(x) for x in raw.T]).any(axis=1)
    assert np.array_equal(np.round(found.t / STEP).astype(int), np.flatnonzero(one_by_one))


def test_it_needs_room_for_the_samples_and_for_what_is_looked_at_at_once():
    """A companion computer has little; all of it at once took fifteen times as much as samples."""
    t = STEP * np.arange(60_000)
    raw = np.random.default_rng(6).normal(size=(len(t), 3))
    still = batches(shaken(0.3))[0]
    segment = replace(still.segment, t=t, w_b=np.zeros_like(raw), raw_s=raw)
    tracemalloc.start()
    try:
        spikes_of([replace(still, segment=segment)])
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 2 * raw.nbytes + 4e6
