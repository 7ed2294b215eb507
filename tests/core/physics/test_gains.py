"""Effects proportional to the force: linearised about their size they take themselves off."""

from types import SimpleNamespace

import numpy as np
import pytest

from onboard.core.diagnosis.regimes import axis_of
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import rotation_from_vector
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_ramp import BiasRamp
from onboard.core.physics.effects.cross_axis import CrossAxis
from onboard.core.physics.effects.load_flex import LoadFlex
from onboard.core.physics.effects.mount_tilt import MountTilt
from onboard.core.physics.effects.scale_nonlinearity import ScaleNonlinearity

F = np.array([[1.0, -2.0, -14.0], [3.0, 0.5, -9.0], [-2.0, 4.0, -20.0]])


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        (CrossAxis, [0.05, -0.04, 0.03, 0.02, -0.05, 0.04]),
        (ScaleNonlinearity, [0.02, -0.03, 0.02]),
    ],
)
def test_about_its_size_the_true_force_comes_back(kind, sizes):
    effect, sizes = kind(Origin(t0=0.0)), np.array(sizes)
    measured = F - effect.amount(F) @ sizes  # what it reads too much is minus the column
    rough = measured + effect.acceleration(SimpleNamespace(f_b=measured)) @ sizes
    fine = measured + effect.about(sizes).acceleration(SimpleNamespace(f_b=measured)) @ sizes
    assert np.max(np.abs(fine - F)) < 0.01 * np.max(np.abs(rough - F))


def test_a_turn_about_its_size_comes_back_as_a_turn():
    """Not as one and its first order, which would make it longer by half of its square."""
    effect, tilt = MountTilt(Origin(t0=0.0)), np.array([0.06, -0.08])
    measured = F @ rotation_from_vector(np.array([*tilt, 0.0])).T
    seen = SimpleNamespace(f_b=measured)
    rough = measured + effect.acceleration(seen) @ tilt
    fine = measured + effect.about(tilt).acceleration(seen) @ tilt
    long = np.linalg.norm(F, axis=1).max()
    assert np.max(np.abs(rough - F)) > 0.3 * 0.1**2 * long
    assert np.max(np.abs(fine - F)) < 0.1**3 * long


def test_a_mount_that_bends_turns_the_force_by_the_load_that_bends_it():
    """By that of the true force, and as a turn: the force stays as long as it is."""
    effect, flex = LoadFlex(Origin(t0=0.0)), np.array([0.06, -0.08])
    load = -F[:, 2] / STANDARD_GRAVITY - 1.0
    turns = rotation_from_vector(np.outer(load, [*flex, 0.0]))
    measured = np.einsum("nij,nj->ni", turns, F)
    seen = SimpleNamespace(f_b=measured)
    rough = measured + effect.acceleration(seen) @ flex
    fine = measured + effect.about(flex).acceleration(seen) @ flex
    largest = np.linalg.norm(flex) * np.abs(load)
    long = np.linalg.norm(F, axis=1)
    assert np.max(np.abs(rough - F)) > 0.3 * np.max(largest**2 * long)
    assert np.all(np.abs(fine - F).max(axis=1) < largest**3 * long)


def test_a_gain_acts_on_the_force_without_the_offsets_beside_it():
    origin, size = Origin(t0=0.0), np.array([0.0, 0.05, 0.0, 0.0, 0.06, -0.07])
    beside, rate = BiasRamp(origin), np.array([0.2, -0.15, 0.1])
    t = np.array([2.0, 8.0, 15.0])
    offset = t[:, None] * rate
    cross = CrossAxis(origin)
    measured = SimpleNamespace(f_b=F - cross.amount(F) @ size + offset, t=t)

    def left(effect):
        back = measured.f_b - offset + effect.acceleration(measured) @ size
        return np.max(np.abs(back - F))

    assert left(cross.about(size, ((beside, rate),))) < 0.1 * left(cross.about(size))


@pytest.mark.parametrize(
    ("key", "axis"),
    [("x", "body_x"), ("zy", "body_z"), ("roll", "body_y"), ("pitch", "body_x"), ("delay", None)],
)
def test_an_unknown_acts_on_the_axis_that_it_disturbs(key, axis):
    assert axis_of(key) == axis
