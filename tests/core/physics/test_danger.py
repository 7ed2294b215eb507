"""Findings are dangerous beyond what an EKF makes up for, and never below it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from onboard.core.physics.catalogue import danger_of, kinds
from onboard.core.physics.finding import Finding, Quantity, ResponseCurve


def found(name, unknowns, *, curve=None, intervals=()):
    return Finding(
        name=name,
        unknowns=unknowns,
        share_of_mismatch=0.5,
        delta_bic=-100.0,
        held_out_before=2.0,
        held_out_after=1.0,
        parameters={},
        cure="",
        intervals=intervals,
        response_curve=curve,
    )


def offset_over_temperature(per_kelvin, span):
    """The law of a drift, over the temperatures that were flown."""
    x = np.linspace(35.0, 35.0 + span, 30)
    curve = ResponseCurve(
        signal="temperature",
        unit="degC",
        quantity="offset error",
        quantity_unit="m/s^2",
        x=x,
        y={"x": np.full(30, np.nan), "z": per_kelvin * (x - 35.0)},
        sigma={"x": np.zeros(30), "z": np.zeros(30)},
    )
    q = {"z": Quantity(per_kelvin, 0.001, "m/s^2/K")}
    return found("temperature_drift", q, curve=curve)


def test_the_same_drift_is_dangerous_only_over_more_kelvin_than_the_ekf_makes_up_for():
    assert not danger_of(offset_over_temperature(-0.05, 19.0))
    said = danger_of(offset_over_temperature(-0.05, 22.0))
    assert "1.1 m/s²" in said
    assert "EK3_ACC_BIAS_LIM" in said


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_heading_is_dangerous_from_where_the_compass_is_taken_for_false(sign):
    def off(degrees):
        return danger_of(
            found("heading_error", {"yaw": Quantity(sign * math.radians(degrees), 0.01, "rad")})
        )

    assert not off(44.0)
    assert "46°" in off(46.0)


def test_a_false_velocity_is_dangerous_by_how_far_it_leads_in_its_longest_spell():
    def astray(speed, *spells):
        return danger_of(
            found("gps_fault", {"offset": Quantity(speed, 0.1, "m/s")}, intervals=spells)
        )

    assert not astray(2.0, (10.0, 20.0), (50.0, 60.0), (90.0, 100.0))
    assert "30 m astray" in astray(2.0, (10.0, 20.0), (50.0, 65.0))


def test_clipping_is_always_dangerous_and_a_late_receiver_never():
    assert danger_of(found("saturation", {"limit": Quantity(78.5, 0.0, "m/s^2")}))
    assert not danger_of(found("gps_latency", {"delay": Quantity(0.4, 0.001, "s")}))


def test_what_is_not_known_is_called_dangerous_by_no_effect():
    for kind in kinds():
        nothing = {"yaw": Quantity(math.nan, math.nan, "rad"), "offset": Quantity(math.nan, 0, "")}
        if kind.effect != "saturation":
            assert danger_of(found(kind.effect, nothing, intervals=((0.0, 100.0),))) == ""
