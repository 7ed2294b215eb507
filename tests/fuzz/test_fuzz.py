"""A little of what ``make fuzz`` does at length; found once, kept for ever in ``found/``."""

from __future__ import annotations

import contextlib
import random
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.errors import OnboardError
from tests.fuzz.mutations import mutated
from tests.fuzz.targets import TARGETS

FOUND = Path(__file__).with_name("found")
QUICK = 40
COSTLY = {"http": 15, "chronicle": 15, "dataflash": 25}
"""Inputs that a target gets here, where one of them takes milliseconds."""
MEMORY = 50_000_000
"""bytes that an input of some thousand may take."""


def attempt(name: str, data: bytes) -> None:
    with contextlib.suppress(OnboardError):
        TARGETS[name].run(data)


@pytest.mark.parametrize("name", TARGETS)
def test_the_samples_are_right(name):
    for seed in TARGETS[name].seeds[:1]:
        attempt(name, seed)


@pytest.mark.parametrize("name", TARGETS)
def test_nearly_right_bytes_give_a_result_or_a_named_error(name):
    target = TARGETS[name]

    @settings(max_examples=COSTLY.get(name, QUICK))
    @given(st.integers(0, 2**32))
    def one(seed):
        attempt(name, mutated(random.Random(seed), target.seeds, target.tokens))

    tracemalloc.start()
    try:
        one()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < MEMORY


@pytest.mark.parametrize(
    "path", sorted(FOUND.glob("*/*.bin")), ids=lambda p: f"{p.parent.name}/{p.name}"
)
def test_what_was_found_once(path):
    attempt(path.parent.name, path.read_bytes())
