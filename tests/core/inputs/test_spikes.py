"""Single false samples are found where they are; what a vehicle feels is left as it is."""

import numpy as np
import pytest

from onboard.core.inputs.spikes import spikes_of
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
