"""What a diagnosis means for a push."""

import dataclasses

import numpy as np
import pytest
from calibrations import calibration

from onboard.core.findings import Diagnosis, Effect, Mismatch, Quantity, Series, Verdict
from onboard.push.physics import headline, judge_physics

NAN = float("nan")


def effect(name, parameters=None, **unknowns):
    return Effect(
        name=name,
        unknowns={key: Quantity(value, 0.01, "") for key, value in unknowns.items()},
        share_of_mismatch=0.5,
        delta_bic=-100.0,
        held_out_before=2.0,
        held_out_after=1.0,
        parameters=parameters or {},
        cure="mend it",
    )


def diagnosis(fuller, *effects, verdict=None):
    return Diagnosis(
        imu=fuller.imu,
        verdict=verdict or (Verdict.EXPLAINED if effects else Verdict.CLEAN),
        calibration=fuller,
        timing={},
        mismatch=Mismatch(False, NAN, NAN, 1.0, NAN, NAN, NAN, NAN),
        effects=effects,
        ambiguous=(),
        not_testable=(),
        ladder=(),
        regimes=(),
        series=Series(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=bool)),
        note="",
    )


PLAIN = calibration()
ARM = effect("gps_lever_arm", {"GPS1_POS_X": 0.6}, x=0.6, y=0.0, z=0.0)


def moved(sigmas, number=0):
    """The plain calibration with one scale moved by so many claimed sigmas."""
    scale = list(PLAIN.scale)
    scale[number] += sigmas * PLAIN.scale_sigma[number]
    return dataclasses.replace(PLAIN, scale=tuple(scale))


def test_a_clean_flight_forbids_nothing():
    found = judge_physics(PLAIN, diagnosis(PLAIN), {})
    assert (found.missing, found.modelled) == ("", False)
    assert found.calibration is PLAIN


def test_a_lever_arm_that_moves_a_number_past_its_claim_is_said_and_its_model_offered():
    fuller = moved(3.8)
    found = judge_physics(PLAIN, diagnosis(fuller, ARM), {})
    assert "antenna is 0.6 m away" in found.missing
    assert "GPS1_POS_X 0.60" in found.missing
    assert "x scale" in found.missing
    assert found.modelled
    assert found.calibration is fuller


@pytest.mark.parametrize("sigmas", [-1.5, 0.0, 1.5])
def test_an_effect_within_the_claim_forbids_nothing(sigmas):
    found = judge_physics(PLAIN, diagnosis(moved(sigmas), ARM), {})
    assert found.missing == ""
    assert found.calibration is PLAIN


def test_a_number_that_the_flight_does_not_show_cannot_be_moved():
    hidden = dataclasses.replace(PLAIN, observable=(False, True, True, True, True, True))
    assert judge_physics(hidden, diagnosis(moved(50.0), ARM), {}).missing == ""


def test_what_every_model_has_forbids_nothing():
    late = effect("gps_latency", {"GPS1_DELAY_MS": 120.0}, delay=0.12)
    found = judge_physics(PLAIN, diagnosis(moved(5.0), late), {})
    assert found.missing == ""
    assert found.effects == ("gps_latency",)


@pytest.mark.parametrize("name", ["bias_step", "bias_ramp", "temperature_drift", "saturation"])
def test_where_no_one_number_holds_none_is_offered(name):
    found = judge_physics(PLAIN, diagnosis(PLAIN, effect(name, x=0.1)), {})
    assert "mend it" in found.missing
    assert not found.modelled
    assert found.calibration is PLAIN


@pytest.mark.parametrize("verdict", [Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED])
def test_a_residual_that_is_not_noise_forbids_it(verdict):
    effects = (ARM,) if verdict is Verdict.PARTLY_EXPLAINED else ()
    found = judge_physics(PLAIN, diagnosis(PLAIN, *effects, verdict=verdict), {})
    assert "not noise" in found.missing
    assert not found.modelled


@pytest.mark.parametrize(
    ("verdict", "effects", "severity"),
    [
        ("clean", [], "good"),
        ("explained", ["gps_latency", "gps_smoothing"], "info"),
        ("explained", ["gps_latency", "cross_axis"], "warning"),
        ("partly_explained", ["gps_latency"], "warning"),
        ("unexplained", [], "error"),
        ("insufficient", [], "warning"),
    ],
)
def test_a_late_receiver_is_no_missing_physics(verdict, effects, severity):
    sentence, found = headline(verdict, effects)
    assert found == severity
    assert ("missing from the model" in sentence) == (severity == "warning" and bool(effects))


def test_every_verdict_has_a_headline():
    for verdict in Verdict:
        assert headline(verdict.value, [])[0].endswith(".")
