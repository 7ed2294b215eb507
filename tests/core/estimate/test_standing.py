"""What an accelerometer reads at rest, whatever its attitude, and when nobody saw it standing."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.result import Calibration, Coverage
from onboard.core.estimate.standing import Standing
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import ImuSample
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.core.maths.board_orientation import board_rotation
from onboard.core.maths.earth import STANDARD_GRAVITY as G

TRUE = SixParameters((1.01, 0.98, 1.03), (0.1, -0.2, 0.3))
IN_FORCE = SixParameters((1.0, 1.0, 0.99), (0.0, 0.1, 0.0))
SIGMA = np.array([0.01, 0.01, 0.02, 0.1, 0.1, 0.05])
ORIENTATION = 4.0
R_bs = board_rotation(ORIENTATION)


def parameters(six=IN_FORCE):
    names = parameter_names(1).six
    values = dict(zip(names, six.scale + six.offset, strict=True))
    return ParametersInForce({**values, "AHRS_ORIENTATION": ORIENTATION})


def stood(down_b, seconds, *, start=0.0, shaken=0.0, turned=0.0, six=IN_FORCE):
    """Samples of a vehicle that stands with gravity along ``down_b``: t and (n, 6)."""
    rng = np.random.default_rng(5)
    t = start + np.arange(0.0, seconds, 0.02)
    f_b = -G * np.array(down_b) / np.linalg.norm(down_b)
    f_s = six.apply(TRUE.undo(R_bs.T @ f_b))
    force = R_bs @ f_s + rng.normal(0.0, 0.01 + shaken, (len(t), 3))
    return t, np.hstack([rng.normal(0.0, 0.001 + turned, (len(t), 3)), force])


def calibration(six):
    empty = Calibration.unanswered(
        1, IN_FORCE, "", parameters_known=True, coverage=Coverage(0.0, (0.0,) * 6, "", "")
    )
    covariance = tuple(map(tuple, np.diag(SIGMA**2).tolist()))
    return replace(empty, scale=six.scale, offset=six.offset, covariance=covariance)


@pytest.mark.parametrize("down_b", [(0.0, 0.0, 1.0), (0.3, -0.4, 0.8)])
def test_the_right_six_read_gravity_whatever_the_attitude(down_b):
    standing, known = Standing(), parameters()
    standing.hear(1, *stood(down_b, 21.0), known)
    got = standing.of(calibration(TRUE), known)
    assert got is not None
    assert got.estimate == pytest.approx(0.0, abs=2e-3)
    f_s = TRUE.undo(R_bs.T @ (-G * np.array(down_b) / np.linalg.norm(down_b)))
    assert got.in_force == pytest.approx(np.linalg.norm(IN_FORCE.apply(f_s)) - G, abs=2e-3)
    assert got.seconds == 20.0


def test_what_died_in_flight_is_not_asked_what_it_reads_after_it():
    standing, known = Standing(), parameters()
    standing.hear(1, *stood((0.0, 0.0, 1.0), 21.0), known)
    dead = np.tile([0.0, 0.0, 0.0, 3.0, 3.0, 3.0], (2000, 1))
    standing.hear(1, 300.0 + 0.02 * np.arange(2000), dead, known)
    assert standing.of(calibration(TRUE), known).estimate < -4.0
    got = standing.of(calibration(TRUE), known, 200.0)
    assert got.estimate == pytest.approx(0.0, abs=2e-3)
    assert got.seconds == 20.0


def test_its_sigma_is_that_of_the_estimate_along_gravity():
    """As errors of the six drawn from their covariance scatter it."""
    standing, known = Standing(), parameters()
    standing.hear(1, *stood((0.1, 0.2, 1.0), 21.0), known)
    rng = np.random.default_rng(1)
    drawn = []
    for error in SIGMA * rng.standard_normal((400, 6)):
        x = np.array(TRUE.scale + TRUE.offset) + error
        wrong = SixParameters(tuple(x[:3].tolist()), tuple(x[3:].tolist()))
        drawn.append(standing.of(calibration(wrong), known).estimate)
    assert standing.of(calibration(TRUE), known).sigma == pytest.approx(np.std(drawn), rel=0.12)


@pytest.mark.parametrize(
    "moved",
    [{"shaken": 0.5}, {"turned": 0.05}, {"seconds": 5.0}],
    ids=["shaken", "turned", "short"],
)
def test_nothing_is_said_of_what_did_not_stand(moved):
    standing, known = Standing(), parameters()
    standing.hear(1, *stood((0.0, 0.0, 1.0), **{"seconds": 21.0, **moved}), known)
    assert standing.of(calibration(TRUE), known) is None


def test_motors_that_ran_in_between_are_left_out():
    standing, known = Standing(), parameters()
    standing.hear(1, *stood((0.0, 0.0, 1.0), 20.0), known)
    standing.hear(1, *stood((0.6, 0.0, 1.0), 20.0, start=20.0, shaken=1.0), known)
    standing.hear(1, *stood((0.0, 0.3, 1.0), 20.1, start=40.0), known)
    got = standing.of(calibration(TRUE), known)
    assert got.seconds == 40.0
    assert got.estimate == pytest.approx(0.0, abs=2e-3)


def test_samples_one_by_one_say_the_same():
    t, rows = stood((0.1, 0.0, 1.0), 21.0)
    at_once, one_by_one, known = Standing(), Standing(), parameters()
    at_once.hear(1, t, rows, known)
    for s, row in zip(t.tolist(), rows.tolist(), strict=True):
        one_by_one.hear_one(ImuSample(s, 1, tuple(row[3:]), tuple(row[:3])), known)
    one_by_one.catch_up(1, known)
    a, b = (x.of(calibration(TRUE), known) for x in (at_once, one_by_one))
    assert a.estimate == pytest.approx(b.estimate, abs=1e-9)
    assert a.seconds == b.seconds


def test_parameters_that_come_later_are_those_in_force():
    """A recording of telemetry begins before they are reported; a change in between is undone."""
    standing, known = Standing(), ParametersInForce({"AHRS_ORIENTATION": ORIENTATION})
    standing.hear(1, *stood((0.0, 0.0, 1.0), 21.0), known)
    assert standing.of(calibration(TRUE), parameters()).estimate == pytest.approx(0.0, abs=2e-3)
    other = SixParameters((1.02, 1.0, 1.0), (0.2, 0.0, -0.4))
    changed = Standing()
    changed.hear(1, *stood((0.0, 0.0, 1.0), 21.0), parameters())
    changed.hear(1, *stood((0.0, 0.0, 1.0), 21.0, start=30.0, six=other), parameters(other))
    got = changed.of(calibration(TRUE), parameters(other))
    assert got.estimate == pytest.approx(0.0, abs=2e-3)
    assert got.seconds == 40.0
