"""One policy decides what a file sets: what it would not write is a comment with its reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.answers.advice import advise
from onboard.answers.answer import judged
from onboard.answers.verdict import cures, missing, remarks
from onboard.core.diagnosis.records import Ambiguity, Inconstant, Plain, Verdict
from onboard.core.estimate.result import Status
from onboard.core.physics.finding import Confounder, Quantity, ResponseCurve
from onboard.report.parameters import parameter_text
from tests.report.diagnoses_by_hand import IN_FORCE, NAN, advice_on, calibration, diagnosis, effect
from tests.report.test_report_parameters import loaded

STEP = effect(
    "bias_step",
    unknowns={
        "time": Quantity(187.6, 0.5, "s"),
        "x": Quantity(0.3534, 0.002, "m/s^2"),
        "y": Quantity(-0.2, 0.002, "m/s^2"),
        "z": Quantity(0.0, 0.002, "m/s^2"),
    },
    parameters={},
    cure="inspect the mount",
    confounders=(),
)
DRIFT = effect(
    "temperature_drift",
    unknowns={
        a: Quantity(q, 1e-4, "m/s^2/K") for a, q in zip("xyz", (-0.025, 0.03, 0.0), strict=True)
    },
    parameters={},
    cure="calibrate it",
    confounders=(),
    response_curve=ResponseCurve("temperature", "°C", "", "", np.linspace(24.6, 47.2), {}, {}),
)
TILT = effect(
    "mount_tilt",
    unknowns={"roll": Quantity(0.037, 0.01, "rad"), "pitch": Quantity(0.079, 0.011, "rad")},
    parameters={"AHRS_TRIM_X": -0.037, "AHRS_TRIM_Y": -0.079},
    cure="level the autopilot again, or set AHRS_TRIM",
    held_out_before=2.0,
    held_out_after=1.0,
    confounders=(),
)


ANTENNA = effect(
    "gps_lever_arm",
    unknowns={"x": Quantity(0.4, 0.01, "m")},
    parameters={"GPS1_POS_X": 0.4},
    cure="measure the antenna's place",
    confounders=(),
)


def written(made, parameters=IN_FORCE) -> str:
    """The file of the answer that a diagnosis gives."""
    given = judged(made)
    return parameter_text(given.diagnosis, advise((given,), parameters)[0])


def comment(text: str, name: str) -> str:
    """The comment above a parameter that is not set, and its own line."""
    lines = text.splitlines()
    at = next(i for i, line in enumerate(lines) if f" {name}," in line)
    assert lines[at].startswith("# not set")
    return f"{lines[at - 1]} {lines[at]}"


def test_an_offset_that_jumped_is_a_comment_with_both_values_and_since_when():
    text = written(diagnosis(effects=(STEP,)))
    assert loaded(text) == {}
    said = comment(text, "INS_ACCOFFS_X")
    after = 0.2 + 0.3534 / 1.01234567
    assert f"0.2000 until 188 s, {after:.4f} from then on" in said
    assert "the offset jumped" in text


def test_a_rotated_boards_jump_is_told_in_the_axes_of_its_parameters():
    turned = written(diagnosis(effects=(STEP,)), IN_FORCE | {"AHRS_ORIENTATION": 4.0})
    after = 0.2 - 0.3534 / 1.01234567  # yaw by 180 degrees: the sensor's x points aft
    assert f"0.2000 until 188 s, {after:.4f} from then on" in comment(turned, "INS_ACCOFFS_X")


def test_a_drift_says_at_which_temperature_its_offset_holds_and_what_was_flown():
    text = written(diagnosis(effects=(DRIFT,)))
    assert loaded(text) == {}
    said = comment(text, "INS_ACCOFFS_Y")
    assert "-0.1000 at 35 degC, +0.0303 per degree, flown from 25 to 47 degC" in said


def test_no_improvement_is_not_called_for_by_a_page_either():
    worse = diagnosis(
        effects=(),
        calibration=calibration(held_out_before=0.90, held_out_after=0.89, predictive_gain=3.0),
    )
    said = cures(worse, advice_on(worse))[-1]
    assert "Leave the calibration parameters as they are" in said
    assert "0.9 to 0.89 only" in said
    assert not any(n.startswith("INS_") for n in loaded(written(worse)))


def test_parameters_that_the_recording_lacks_are_said_to_be_assumed_and_nothing_is_set():
    text = written(diagnosis(calibration=calibration(parameters_known=False)), {})
    assert loaded(text) == {}
    assert "scale 1 and offset 0 are assumed" in text
    assert "GPS1_DELAY_MS in force is not in the recording" in text


def test_a_parameter_that_the_autopilot_lacks_is_not_put_off_to_a_better_flight():
    made = diagnosis(verdict=Verdict.PARTLY_EXPLAINED)
    (why,) = [s for s in cures(made, advice_on(made, {"GPS_TYPE": 1.0})) if "Do not set" in s]
    assert why == (
        "Do not set GPS1_DELAY_MS = 210 yet: "
        "GPS1_DELAY_MS in force is not in the recording (old firmware has none)."
    )


def test_a_trim_is_not_set_from_a_flight_that_does_not_calibrate_the_accelerometer():
    shy = calibration(status=Status.INSUFFICIENT)
    text = written(diagnosis(effects=(TILT,), calibration=shy))
    assert loaded(text) == {}
    assert "read off from the accelerometer" in comment(text, "AHRS_TRIM_Y")
    assert "AHRS_TRIM_Y" in loaded(written(diagnosis(effects=(TILT,))))


def test_a_trim_without_strong_evidence_is_not_set():
    little = replace(TILT, held_out_before=0.747, held_out_after=0.736, delta_bic=-9.0)
    text = written(diagnosis(effects=(little,)))
    assert "AHRS_TRIM_Y" not in loaded(text)
    assert "falls from 0.747 to 0.736 only" in comment(text, "AHRS_TRIM_Y")


@pytest.mark.parametrize(
    "doubt",
    [
        {"effects": (replace(TILT, confounders=(Confounder("cross_axis", 9.0),)),)},
        {"effects": (TILT,), "ambiguous": (Ambiguity(("cross_axis", "mount_tilt"), "turn"),)},
    ],
    ids=["rival", "ambiguity"],
)
def test_a_cure_beside_which_a_confounder_stands_is_not_set(doubt):
    text = written(diagnosis(**doubt))
    assert "AHRS_TRIM_Y" not in loaded(text)
    assert "not told apart from cross_axis" in comment(text, "AHRS_TRIM_Y")
    assert "Do not set AHRS_TRIM" in " ".join(
        cures(diagnosis(**doubt), advice_on(diagnosis(**doubt)))
    )


@pytest.mark.parametrize("verdict", [Verdict.PARTLY_EXPLAINED, Verdict.UNEXPLAINED])
def test_no_cure_is_set_while_something_else_is_missing(verdict):
    text = written(diagnosis(verdict=verdict, effects=(TILT,)))
    assert loaded(text) == {}
    assert "does not explain all" in comment(text, "AHRS_TRIM_X")


def test_what_is_not_the_same_all_flight_long_is_not_set_and_the_rest_is():
    words = "the latency of GPS grows from 110 to 210 ms over the flight"
    antenna = effect(
        "gps_lever_arm",
        unknowns={"x": Quantity(0.4, 0.01, "m")},
        parameters={"GPS1_POS_X": 0.4},
        confounders=(),
    )
    late = effect(confounders=())
    made = diagnosis(
        effects=(late, antenna), inconstant=(Inconstant(late.name, words, contradicts=False),)
    )
    text = written(made)
    assert "GPS1_DELAY_MS" not in loaded(text)
    assert words in comment(text, "GPS1_DELAY_MS")
    assert loaded(text)["GPS1_POS_X"] == pytest.approx(0.4)
    constant = written(replace(made, inconstant=()))
    assert loaded(constant)["GPS1_DELAY_MS"] == pytest.approx(210.0)


@pytest.mark.parametrize(
    ("made", "parameters"),
    [
        ({"effects": (ANTENNA, STEP)}, IN_FORCE),
        ({"effects": (ANTENNA, effect("throttle_coupling", parameters={}, cure=""))}, IN_FORCE),
        ({"effects": (ANTENNA,), "calibration": calibration(status=Status.INSUFFICIENT)}, IN_FORCE),
        ({"effects": (replace(ANTENNA, held_out_after=3.0),)}, IN_FORCE),
        ({"effects": (ANTENNA,)}, {}),
        ({"effects": (ANTENNA,)}, {"GPS_POS1_X": 0.0}),
        ({"effects": (ANTENNA,)}, IN_FORCE),
    ],
    ids=["jump", "throttle", "uncalibrated", "no better", "not recorded", "older", "settable"],
)
def test_the_reason_against_the_six_asks_for_what_may_be_set_and_for_nothing_else(made, parameters):
    c = calibration()
    moved = Plain((c.scale[0] - 1.0, *c.scale[1:], *c.offset), c.scale_sigma + c.offset_sigma)
    given = judged(diagnosis(plain=moved, **made), parameters)
    (advice,) = advise((given,), parameters)
    (name,) = [n for n in ("GPS_POS1_X", "GPS1_POS_X") if n in (parameters or IN_FORCE)]
    asked = f"set {name} 0.4" in given.missing
    assert given.missing
    assert asked == (name in advice.to_set(given.diagnosis.effects))
    told = " ".join(cures(given.diagnosis, advice))
    assert asked != ("Do not set" in told)
    assert "easure the antenna's place" in told


def test_why_a_flight_whose_constants_change_calibrates_nothing_is_said_once():
    words = "the latency of GPS is not the same in parts of the flight (80 ms until 9 s, 0 after)"
    made = diagnosis(
        verdict=Verdict.PARTLY_EXPLAINED,
        inconstant=(Inconstant("gps_latency", words),),
        note=f"{words}; nothing of it is set.",
    )
    given = judged(made)
    assert given.missing == words
    assert given.calibration.status is Status.INSUFFICIENT
    told = [*missing(made), *remarks(made)]
    assert sum(words[1:] in s for s in told) == 1


def test_an_older_autopilot_gets_the_names_that_it_has():
    older = {"GPS_DELAY_MS": 0.0}
    assert loaded(written(diagnosis(), older))["GPS_DELAY_MS"] == 210.0


def test_the_numbers_that_are_set_belong_to_those_that_stay():
    """z scale is not seen and stays at 1; the z offset that belongs to it is not the estimate's."""
    c = calibration(offset=(0.2, -0.1, 0.5))
    rows = [list(row) for row in c.covariance]
    rows[2][2] = 0.02**2
    rows[5][5] = 0.2**2
    rows[2][5] = rows[5][2] = -0.9 * 0.02 * 0.2
    c = replace(c, covariance=tuple(map(tuple, rows)))
    set_now = loaded(written(diagnosis(effects=(), calibration=c)))
    assert "INS_ACCSCAL_Z" not in set_now
    assert set_now["INS_ACCOFFS_Z"] == pytest.approx(0.5 - 9.0 * (1.0 - 1.002), abs=1e-6)


def test_numbers_that_make_no_plan_are_refused():
    made = diagnosis(effects=(), calibration=calibration(scale=(NAN,) * 3))
    advice = advice_on(made)
    assert not advice.settable
    assert advice.plan is None
    assert advice.reasons == ("there is no usable estimate",)
