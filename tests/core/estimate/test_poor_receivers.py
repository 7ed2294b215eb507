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


def interpolated(flight, older, apart=1.0):
    """A fix every ``apart`` seconds, on the line between itself and the one before."""
    before, out = None, []
    for s in flight.samples:
        if not isinstance(s, GpsFix):
            out.append(s)
        elif before is None or s.t - before.t > apart - 0.05:
            if before is not None:
                named = [n for n in ("v_n", "v_e", "v_d", "altitude") if getattr(s, n) is not None]
                line = {
                    n: (1.0 - older) * getattr(s, n) + older * getattr(before, n) for n in named
                }
                out.append(replace(s, **line))
            before = s
    return out


@pytest.mark.parametrize(("vehicle", "older"), [("plane", 0.2), ("copter", 0.2), ("copter", 0.05)])
def test_a_line_between_fixes_a_second_apart_is_followed(vehicle, older):
    """Both its ends are looked at, however far they are from the moment that a fix tells of."""
    flown = FlightSpec(vehicle=vehicle, seed=5, duration=150.0, imus=random_imus(5))
    flight = simulated(flown)
    got = fed(interpolated(flight, older)).calibration(1)
    assert got.status is Status.CALIBRATED
    sigma = np.array(got.scale_sigma + got.offset_sigma)
    assert np.all(np.abs(error_of(got, flight)) < 3.0 * sigma)
    assert sigma[:3].max() < 0.01


@pytest.mark.parametrize("apart", [1.0, 1.4])
def test_what_so_few_fixes_average_in_a_way_that_they_do_not_show_is_not_believed(apart):
    """Half a second of delay is more than is looked for, and neighbours may be too far away."""
    flown = FlightSpec(vehicle="plane", seed=5, duration=150.0, imus=random_imus(5))
    got = fed(interpolated(simulated(flown), 0.5 / apart, apart)).calibration(1)
    assert got.status is Status.INSUFFICIENT
    assert "averag" in got.note or "latency" in got.note, got.note
