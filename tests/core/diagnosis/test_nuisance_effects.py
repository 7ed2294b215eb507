"""Effects that are in every model: from which size on they count, and what is none of them."""

import numpy as np
import pytest

from onboard.core.diagnosis.nuisance_effects import (
    constant_unknowns,
    nuisance_effects,
    nuisance_kinds,
    timing_unknowns,
    without,
)
from onboard.core.estimate.gps_clock import FixClock
from onboard.core.estimate.result import Estimate
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.nuisances import SHAPES
from onboard.core.physics.effect import SURE, NuisanceFit
from onboard.core.physics.effects.heading_error import EKF_SIGMA_RAD as HEADING_SIGMA
from onboard.core.physics.effects.heading_error import LEAST_RAD as LEAST_HEADING
from onboard.core.physics.effects.mount_tilt import EKF_SIGMA_RAD as TILT_SIGMA
from onboard.core.physics.effects.mount_tilt import LEAST_RAD as LEAST_TILT

UNKNOWNS = (
    *(f"scale_{a}" for a in "xyz"),
    *(f"beta_{a}" for a in "xyz"),
    *("gps_delay", "window_squared", "attitude_delay", "tilt_roll", "tilt_pitch", "heading"),
)
INDEX = {name: i for i, name in enumerate(UNKNOWNS)}
SURELY = 1e-4
POINT = Linearisation(delay=0.13, window=0.2, attitude_delay=0.011, heading=0.03)
TOLD = 0.1


def nuisances(
    *,
    delay=(TOLD, SURELY),
    window=(0.0, SURELY),
    lag=(0.0, SURELY),
    heading=(0.0, SURELY),
    tilt=((0.0, 0.0), SURELY),
    parameters=None,
    point=None,
):
    """What one fit says; each number with its sigma."""
    point = point or Linearisation()
    theta, sigma = np.zeros(len(UNKNOWNS)), np.full(len(UNKNOWNS), SURELY)
    theta[:3] = 1.0
    theta[INDEX["heading"]] = heading[0] - point.heading
    sigma[INDEX["heading"]] = heading[1]
    for name, value in zip(("tilt_roll", "tilt_pitch"), tilt[0], strict=True):
        theta[INDEX[name]], sigma[INDEX[name]] = value, tilt[1]
    return NuisanceFit(
        timing={
            "gps_delay_s": Estimate(*delay),
            "gps_smoothing_window_s": Estimate(*window),
            "imu_delay_s": Estimate(*lag),
        },
        theta=theta,
        sigma=sigma,
        index=INDEX,
        point=point,
        parameters=ParametersInForce(parameters or {}),
        imu=1,
        clock=FixClock(configured=TOLD, assumed=(TOLD,)),
    )


def found(**numbers):
    return nuisance_effects(lambda _: nuisances(**numbers))


LEAST = {
    "gps_latency": ("delay", nuisance_kinds()["gps_latency"].least, TOLD),
    "gps_smoothing": ("window", nuisance_kinds()["gps_smoothing"].least, 0.0),
    "imu_delay": ("lag", nuisance_kinds()["imu_delay"].least, 0.0),
    "heading_error": ("heading", LEAST_HEADING, 0.0),
}
"""Effects: their number, the size from which it counts, and what it is counted from."""


def test_these_are_all():
    assert set(nuisance_kinds()) == {*LEAST, "mount_tilt"}
    timing = {"attitude_delay", "gps_delay", "window_squared", *SHAPES}
    assert set(timing_unknowns()) == timing
    assert sorted(constant_unknowns()) == ["heading", "tilt_pitch", "tilt_roll"]
    every = {u for kind in nuisance_kinds().values() for u in kind.in_every_model}
    assert every == {*timing_unknowns(), *constant_unknowns()}


def test_a_flight_in_which_all_is_well_has_none():
    assert found() == {}


@pytest.mark.parametrize(
    ("name", "sign"),
    [(n, s) for n in LEAST for s in (1.0, -1.0) if (n, s) != ("gps_smoothing", -1.0)],
)
def test_an_effect_counts_from_its_least_size_on(name, sign):
    number, least, centre = LEAST[name]
    assert found(**{number: (centre + sign * 0.99 * least, SURELY)}) == {}
    value = centre + sign * 1.01 * least
    ((got, (unknowns, cure)),) = found(**{number: (value, SURELY)}).items()
    assert got == name
    (quantity,) = unknowns.values()
    assert quantity.value == pytest.approx(value)
    assert cure.words


@pytest.mark.parametrize("name", LEAST)
def test_what_is_not_sure_does_not_count_however_large(name):
    number, least, centre = LEAST[name]
    size = 3.0 * least
    own = HEADING_SIGMA if name == "heading_error" else 0.0
    edge = np.sqrt((size / SURE) ** 2 - own**2)
    assert set(found(**{number: (centre + size, 0.99 * edge)})) == {name}
    assert found(**{number: (centre + size, 1.01 * edge)}) == {}


@pytest.mark.parametrize("toward", [(1.0, 0.0), (0.0, -1.0), (0.6, 0.8)])
def test_a_tilt_counts_by_its_whole_angle(toward):
    unit = np.array(toward)
    assert found(tilt=(0.99 * LEAST_TILT * unit, SURELY)) == {}
    # An EKF's own tilt is doubted, too: one that is just past the least is not sure.
    big = 1.5 * SURE * max(TILT_SIGMA) * unit
    ((name, (unknowns, _)),) = found(tilt=(big, SURELY)).items()
    assert name == "mount_tilt"
    assert [unknowns[k].value for k in ("roll", "pitch")] == pytest.approx(big)
    for key, own in zip(("roll", "pitch"), TILT_SIGMA, strict=True):
        assert unknowns[key].sigma == pytest.approx(np.hypot(SURELY, own))
    assert found(tilt=(big, 1.0)) == {}


def test_a_tilt_that_the_trim_takes_off_the_reported_attitude_is_cured_already():
    tilt = (0.04, 0.0)
    assert set(found(tilt=(tilt, SURELY))) == {"mount_tilt"}
    assert found(tilt=(tilt, SURELY), parameters={"AHRS_TRIM_X": 0.04}) == {}
    assert set(found(tilt=(tilt, SURELY), parameters={"AHRS_TRIM_X": -0.04})) == {"mount_tilt"}


def test_effects_beside_each_other_are_all_told():
    got = found(delay=(0.3, SURELY), window=(0.3, SURELY), heading=(0.2, SURELY))
    assert set(got) == {"gps_latency", "gps_smoothing", "heading_error"}


# -- values at which an unknown is not in the model -------------------------------------------


def taken_in(theta, point=POINT):
    """What the unknowns of the linearisation come to with ``theta`` added."""
    return {
        "gps_delay": point.delay + theta[INDEX["gps_delay"]],
        "window_squared": point.window**2 + theta[INDEX["window_squared"]],
        "attitude_delay": point.attitude_delay + theta[INDEX["attitude_delay"]],
        "heading": point.heading + theta[INDEX["heading"]],
        "tilt_roll": theta[INDEX["tilt_roll"]],
        "tilt_pitch": theta[INDEX["tilt_pitch"]],
    }


NOTHING = dict.fromkeys(taken_in(np.zeros(len(UNKNOWNS))), 0.0) | {"gps_delay": TOLD}
"""What each comes to when there is no such effect: as late as it was told, and no error."""


def test_without_an_unknown_nothing_of_it_is_left_in_the_model():
    before = np.random.default_rng(1).normal(size=len(UNKNOWNS))
    kept = before.copy()
    at = without(tuple(NOTHING), INDEX, POINT, before, TOLD)
    assert taken_in(at) == pytest.approx(NOTHING)
    np.testing.assert_array_equal(at[:6], before[:6])
    np.testing.assert_array_equal(before, kept)


@pytest.mark.parametrize("name", NOTHING)
def test_each_is_taken_out_alone_and_comes_back(name):
    before = np.random.default_rng(2).normal(size=len(UNKNOWNS))
    at = without([name], INDEX, POINT, before, TOLD)
    assert taken_in(at)[name] == pytest.approx(NOTHING[name])
    others = np.arange(len(UNKNOWNS)) != INDEX[name]
    np.testing.assert_array_equal(at[others], before[others])
    again = without([name], INDEX, POINT, at, TOLD)
    np.testing.assert_array_equal(again, at)


def test_an_absent_unknown_is_what_the_catalogue_reports_as_nothing():
    """Round trip: a flight whose unknowns are all absent has no effect to tell of."""
    at = without(tuple(NOTHING), INDEX, POINT, np.zeros(len(UNKNOWNS)), TOLD)
    total = taken_in(at)
    got = found(
        point=POINT,
        delay=(total["gps_delay"], SURELY),
        window=(np.sqrt(abs(total["window_squared"])), SURELY),
        lag=(total["attitude_delay"], SURELY),
        heading=(total["heading"], SURELY),
        tilt=((total["tilt_roll"], total["tilt_pitch"]), SURELY),
    )
    assert got == {}


def test_other_columns_are_absent_at_zero():
    index = INDEX | {"extra": len(UNKNOWNS)}
    at = without(["extra"], index, POINT, np.ones(len(index)), TOLD)
    assert at[-1] == 0.0
