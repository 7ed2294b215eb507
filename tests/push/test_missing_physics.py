"""What a diagnosis means for its calibration: one status, by one set of rules."""

import dataclasses

import numpy as np
import pytest

from onboard.answers.answer import diagnosed, judged
from onboard.core.diagnosis.records import Diagnosis, Mismatch, Plain, Series, Verdict
from onboard.core.estimate.result import Status
from onboard.core.physics.finding import Finding, Quantity
from onboard.push.diagnosed import headline
from tests.push.calibrations import SIGMAS, calibration, covariance

NAN = float("nan")


def effect(name, parameters=None, **unknowns):
    return Finding(
        name=name,
        unknowns={key: Quantity(value, 0.01, "") for key, value in unknowns.items()},
        share_of_mismatch=0.5,
        delta_bic=-100.0,
        held_out_before=2.0,
        held_out_after=1.0,
        parameters=parameters or {},
        cure="mend it",
    )


FOUND = calibration()


def plain(sigmas=0.0, number=0):
    """The six without the effects: one scale is so many of its claimed sigmas lower."""
    value = list(FOUND.scale + FOUND.offset)
    value[number] -= sigmas * SIGMAS[number]
    return Plain(tuple(value), SIGMAS)


def diagnosis(*effects, without=None, verdict=None, **changes):
    return Diagnosis(
        imu=FOUND.imu,
        verdict=verdict or (Verdict.EXPLAINED if effects else Verdict.CLEAN),
        calibration=dataclasses.replace(FOUND, **changes),
        timing={},
        mismatch=Mismatch(False, NAN, NAN, 1.0, NAN, NAN, NAN, NAN),
        effects=effects,
        ambiguous=(),
        not_testable=(),
        ladder=(),
        regimes=(),
        series=Series(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=bool)),
        note="",
        plain=without,
    )


ARM = effect("gps_lever_arm", {"GPS1_POS_X": 0.6}, x=0.6, y=0.0, z=0.0)
THROTTLE = effect("throttle_coupling", x=0.3)


def test_a_clean_flight_forbids_nothing():
    found = judged(diagnosis())
    assert (found.missing, found.modelled) == ("", False)
    assert found.calibration == FOUND


def test_a_lever_arm_that_moves_a_number_past_its_claim_is_said_and_its_model_offered():
    found = judged(diagnosis(ARM, without=plain(3.8)))
    assert "antenna is 0.6 m away" in found.missing
    assert "first set GPS1_POS_X 0.6, then fly again" in found.missing
    assert "x scale by +0.0038, 3.8 sigma" in found.missing
    assert found.modelled
    assert found.calibration.status is Status.CALIBRATED
    assert found.calibration.scale == FOUND.scale
    assert "taken into account beside the six" in found.calibration.note


@pytest.mark.parametrize("name", ["accelerometer_spikes", "gps_fault", "accelerometer_resolution"])
def test_what_is_false_in_the_data_is_noted_and_forbids_nothing(name):
    """Only a diagnosis shows its findings: a replay and the service have the calibration's note."""
    found = judged(diagnosis(effect(name, size=9.8)))
    assert found.missing == ""
    assert found.calibration.status is Status.CALIBRATED
    assert f"({name})" in found.calibration.note
    beside = judged(diagnosis(effect(name, size=9.8), effect("bias_step", x=0.1)))
    assert f"({name})" in beside.calibration.note
    assert name not in beside.missing


@pytest.mark.parametrize("sigmas", [-1.5, 0.0, 1.5])
@pytest.mark.parametrize("found", [ARM, THROTTLE])
def test_an_effect_within_the_claim_forbids_nothing(sigmas, found):
    given = judged(diagnosis(found, without=plain(sigmas)))
    assert given.missing == ""
    assert given.calibration == FOUND


def test_a_number_that_the_flight_does_not_show_cannot_be_moved():
    wide = (0.03, *SIGMAS[1:])
    found = diagnosis(ARM, without=plain(3.0), covariance=covariance(wide), scale_sigma=wide[:3])
    assert judged(found).missing == ""


def test_a_combination_that_is_known_counts_where_its_numbers_do_not():
    """z scale and z offset are not known, the force at the load that was flown is."""
    wide = (*SIGMAS[:2], 0.03, *SIGMAS[3:5], 0.3)
    at_load = {"covariance": covariance(wide, [(2, 5, -0.999)]), "load_mean": (0.0, 0.0, -9.8)}
    before = list(FOUND.scale + FOUND.offset)
    before[5] -= 0.25
    without = Plain(tuple(before), wide)
    assert "z force at the mean load" in judged(diagnosis(ARM, without=without, **at_load)).missing


def test_what_every_model_has_forbids_nothing():
    late = effect("gps_latency", {"GPS1_DELAY_MS": 120.0}, delay=0.12)
    found = judged(diagnosis(late))
    assert found.missing == ""
    assert found.calibration.status is Status.CALIBRATED


def test_what_changes_the_meaning_of_a_number_withdraws_it():
    found = judged(diagnosis(THROTTLE, without=plain(3.0)))
    assert "the throttle shifts the offset" in found.missing
    assert not found.modelled
    assert found.calibration.status is Status.INSUFFICIENT


def test_geometry_beside_something_else_withdraws_it():
    found = judged(diagnosis(ARM, THROTTLE, without=plain(3.0)))
    assert not found.modelled
    assert found.calibration.status is Status.INSUFFICIENT


@pytest.mark.parametrize("name", ["bias_step", "bias_ramp", "temperature_drift", "saturation"])
def test_where_no_one_number_holds_none_is_called_calibrated(name):
    found = judged(diagnosis(effect(name, x=0.1), without=plain()))
    assert "mend it" in found.missing
    assert not found.modelled
    assert found.calibration.status is Status.INSUFFICIENT
    assert found.missing in found.calibration.note


@pytest.mark.parametrize("verdict", [Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED])
def test_a_residual_that_is_not_noise_forbids_it(verdict):
    effects = (ARM,) if verdict is Verdict.PARTLY_EXPLAINED else ()
    found = judged(diagnosis(*effects, without=plain(9.0), verdict=verdict))
    assert "not noise" in found.missing
    assert not found.modelled
    assert found.calibration.status is Status.INSUFFICIENT


def test_a_flight_of_which_half_is_refused_is_never_calibrated():
    silent = diagnosis(verdict=Verdict.INSUFFICIENT)
    refused = dataclasses.replace(silent.mismatch, fixes=400, believed=1000)
    found = judged(dataclasses.replace(silent, mismatch=refused, note="half is false."))
    assert found.calibration.status is Status.INSUFFICIENT
    assert found.calibration.note == "half is false."
    assert found.missing == ""


def test_a_flight_too_dull_for_physics_keeps_the_numbers_that_it_shows():
    found = judged(diagnosis(verdict=Verdict.INSUFFICIENT))
    assert found.calibration.status is Status.CALIBRATED
    assert found.missing == ""


@pytest.mark.parametrize("status", [Status.COLLECTING, Status.INVALID])
def test_what_is_not_calibrated_anyway_keeps_its_status(status):
    found = judged(diagnosis(effect("bias_step", x=0.1), status=status))
    assert found.calibration.status is status
    assert not judged(diagnosis(ARM, without=plain(5.0), status=status)).modelled


def test_what_the_daemon_keeps_is_the_answer():
    given = judged(diagnosis(ARM, without=plain(3.8)))
    kept = diagnosed(given, {"schema": "onboard.explain/1"})
    assert (kept.verdict, kept.effects) == ("explained", ("gps_lever_arm",))
    assert (kept.calibration, kept.missing) == (given.calibration, given.missing)
    assert (kept.modelled, kept.resumed) == (True, False)
    assert kept.document == {"schema": "onboard.explain/1"}


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
    assert ("beyond the six numbers, and" in sentence) == (severity == "warning" and bool(effects))


def test_every_verdict_has_a_headline():
    for verdict in Verdict:
        assert headline(verdict.value, [])[0].endswith(".")
