"""An airframe of another simulator: what its table says is what it flew."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from benchmarks import foreign
from benchmarks.foreign_plane import flown
from onboard.core.maths.frames import rotation_from_euler


def test_without_the_other_simulator_it_says_so(monkeypatch, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    foreign.main([])
    assert "jsbsim is not installed" in capsys.readouterr().out


def test_coefficients_are_told_in_the_air_of_the_flight():
    document = {
        "wind": {"north": 1.0, "east": 2.0, "sigma_north": 0.1, "sigma_east": 0.2},
        "effects": [{"name": "lift", "values": {"c_lift_a": {"real": 5.0, "sigma": 0.1}}}],
    }
    rows = list(foreign.compared(document, {"c_lift_a": 4.5}, (1.1, 2.2), 0.9 * 1.225))
    assert rows[:2] == [("wind north", 1.1, 1.0, 0.1), ("wind east", 2.2, 2.0, 0.2)]
    name, truth, found, sigma = rows[2]
    assert (name, truth) == ("c_lift_a", 4.5)
    assert found == pytest.approx(4.5)
    assert sigma == pytest.approx(0.09)


def test_the_force_that_is_written_is_that_of_the_motion():
    pytest.importorskip("jsbsim")
    flight = flown((4.0, -3.0), 5, 30.0)
    t, angles, force = flight.rows[:, 0], flight.rows[:, 1:4], flight.rows[:, 4:7]
    R = rotation_from_euler(*angles.T)
    acceleration = np.einsum("nij,nj->ni", R, force) + np.array([0.0, 0.0, 9.80665])
    seen = np.isfinite(flight.rows[:, 10])
    gained = np.diff(flight.rows[seen, 10:13][[0, -1]], axis=0)[0]
    integral = np.trapezoid(acceleration, t, axis=0)
    # 30 s of an attitude that is 1 mrad noisy and of the earth's turning: a tenth of a m/s.
    assert np.abs(integral - gained).max() < 0.3
