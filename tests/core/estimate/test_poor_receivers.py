"""Receivers that do not measure everything: what they do measure is used."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.recorded import error_of, fed, simulated
from onboard.core.estimate.result import Status
from onboard.core.inputs.samples import GpsFix
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def flight():
    return simulated(FlightSpec(vehicle="copter", seed=5, duration=130.0, imus=random_imus(5)))


@pytest.fixture(scope="module")
def whole(flight):
    return fed(flight.samples)


def changed(flight, **fields):
    return [replace(s, **fields) if isinstance(s, GpsFix) else s for s in flight.samples]


def test_a_height_that_never_changes_is_not_taken_for_one(flight, whole):
    made = fed(changed(flight, altitude=0.0))
    assert whole.engine(1).uses.height
    assert not made.engine(1).uses.height
    got, better = made.calibration(1), whole.calibration(1)
    sigma = np.array(got.scale_sigma + got.offset_sigma)
    assert np.all(np.abs(error_of(got, flight)) < 4.0 * sigma)
    assert got.offset_sigma[2] > better.offset_sigma[2]
    assert "height_innovation" not in got.rejected


def test_a_vertical_velocity_that_is_no_number_is_none(flight, whole):
    got, plain = fed(changed(flight, v_d=math.nan)).calibration(1), whole.calibration(1)
    assert got.scale + got.offset == plain.scale + plain.offset
    assert got.covariance == plain.covariance


def interpolated(flight):
    """One fix a second that says what is between itself and the one before."""
    before, out = None, []
    for s in flight.samples:
        if not isinstance(s, GpsFix):
            out.append(s)
        elif before is None or s.t - before.t > 0.95:
            if before is not None:
                half = {n: 0.5 * (getattr(s, n) + getattr(before, n)) for n in ("v_n", "v_e")}
                out.append(replace(s, **half))
            before = s
    return out


def test_what_so_few_fixes_average_in_a_way_that_they_do_not_show_is_not_believed():
    flown = FlightSpec(vehicle="plane", seed=5, duration=150.0, imus=random_imus(5))
    got = fed(interpolated(simulated(flown))).calibration(1)
    assert got.status is Status.INSUFFICIENT
    assert "averag" in got.note
