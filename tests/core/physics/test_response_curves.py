"""Response curves: what a generator obeys is found, over the range that was flown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from onboard.core.physics.catalogue import response_of
from onboard.core.physics.finding import Quantity

G = 9.80665


@dataclass
class Segment:
    raw_s: np.ndarray
    slow: dict
    R_bs: np.ndarray


@dataclass
class Fixes:
    t: np.ndarray


@dataclass
class Batch:
    segment: Segment
    fixes: Fixes


@pytest.fixture
def flight():
    t = np.linspace(100.0, 200.0, 500)
    force = np.column_stack([2.0 * np.sin(t), 0.5 * np.cos(t), -G * (1.5 + 0.5 * np.sin(t))])
    slow = {
        "temperature": (t, np.linspace(20.0, 50.0, 500)),
        "throttle": (t, np.linspace(0.2, 0.8, 500)),
        "vibration": (t, np.column_stack([t * 0 + 1.0, t * 0 + 2.0, np.linspace(0.0, 9.0, 500)])),
    }
    return [Batch(Segment(force, slow, np.eye(3)), Fixes(t))]


def response_curve(name, flight, /, **values):
    unknowns = {k: Quantity(v, 0.1 * abs(v), "") for k, v in values.items()}
    return response_of(name, unknowns, flight, 100.0, 35.0)


def test_a_drift_is_nothing_at_its_reference_and_covers_what_was_felt(flight):
    found = response_curve("temperature_drift", flight, x=0.01, y=-0.02, z=0.0)
    assert found.x[[0, -1]] == pytest.approx([20.0, 50.0])
    np.testing.assert_allclose(found.y["x"], 0.01 * (found.x - 35.0))
    np.testing.assert_allclose(found.sigma["y"], 0.002 * np.abs(found.x - 35.0))


def test_curvature_is_drawn_for_each_axis_where_it_has_been(flight):
    found = response_curve("scale_nonlinearity", flight, x=0.01, y=0.01, z=0.02)
    seen = np.isfinite(found.y["z"])
    assert found.x[seen].max() < -0.9
    np.testing.assert_allclose(found.y["z"][seen], 0.02 * (G * found.x[seen]) ** 2 / G)
    assert np.abs(found.x[np.isfinite(found.y["x"])]).max() < 0.3


def test_a_jump_is_sharp(flight):
    found = response_of(
        "bias_step",
        {"time": Quantity(40.0, 0.5, "s"), "x": Quantity(0.3, 0.01, "m/s^2")},
        flight,
        100.0,
        35.0,
    )
    assert set(found.y) == {"x"}
    before, after = found.y["x"][found.x < 40.0], found.y["x"][found.x >= 40.0]
    assert np.all(before == 0.0)
    np.testing.assert_allclose(after, 0.3)
    assert np.min(np.diff(found.x)) <= 1e-3 + 1e-9


@pytest.mark.parametrize(
    ("name", "unknown", "at", "value"),
    [
        ("throttle_coupling", "x", 50.0, 0.5),
        ("vibration_rectification", "z", 3.0, 9.0),
        ("heading_by_throttle", "yaw_per_throttle", 50.0, np.degrees(0.5)),
        ("load_flex", "roll", 2.0, np.degrees(1.0)),
        ("bias_ramp", "z", 60.0, 60.0),
        ("clock_skew", "rate", 60.0, 60e3),
    ],
)
def test_one_unit_of_an_unknown_makes_what_the_catalogue_says(flight, name, unknown, at, value):
    found = response_curve(name, flight, **{unknown: 1.0})
    assert np.interp(at, found.x, found.y[unknown]) == pytest.approx(value, rel=2e-2)


def test_what_follows_no_single_signal_has_no_curve(flight):
    assert response_curve("gps_lever_arm", flight, x=1.0) is None
    assert response_curve("temperature_drift", [], x=1.0) is None
    flight[0].segment.slow = {}
    assert response_curve("temperature_drift", flight, x=1.0) is None
