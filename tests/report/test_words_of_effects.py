"""Effects and verdicts in words: true to size, unit and sign, for every name of the vocabulary."""

from __future__ import annotations

import pytest

from onboard.answers.answer import judged
from onboard.answers.verdict import (
    cures,
    dangers,
    headline,
    missing,
    proof,
    remarks,
    severity,
    sized,
    to_fly,
    unused_in_words,
)
from onboard.answers.words import DISTRUST
from onboard.core.diagnosis.records import Unused, Verdict
from onboard.core.gps.distrust import Distrust
from onboard.core.physics.catalogue import kinds, size_of, title_of
from onboard.core.physics.finding import Quantity
from tests.report.diagnoses_by_hand import NAN, advice_on, diagnosis, effect


def of(name: str, unit: str, /, intervals=(), **values: float):
    unknowns = {k: Quantity(v, 0.01 * abs(v) or 0.01, unit) for k, v in values.items()}
    return effect(name, unknowns=unknowns, intervals=intervals)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (of("gps_latency", "s", delay=0.2), "by 200 ± 2 ms"),
        (of("gps_latency", "s", delay=-0.2), "by −200 ± 2 ms"),
        (of("gps_lever_arm", "m", x=0.8, y=-0.5), "0.80 m forward and 0.50 m left"),
        (of("gps_lever_arm", "m", x=1, y=2, z=-4), "1.00 m forward, 2.00 m right and 4.00 m up"),
        (of("gps_lever_arm", "m", x=-0.8, y=0.5, z=0.0), "0.80 m back and 0.50 m right"),
        (of("mount_tilt", "rad", roll=0.0349066, pitch=-0.0523599), "by roll 2.00, pitch −3.00°"),
        (of("heading_error", "rad", yaw=0.0872665), "by 5.00 ± 0.05°"),
        (of("imu_delay", "s", delay=-0.04), "attitude early by 40.0 ± 0.4 ms"),
        (of("cross_axis", "1", xy=0.03, zy=0.0), "xy 3.00 %"),
        (of("clock_skew", "1", rate=2e-4), "by 200 ± 2 ppm"),
        (of("scale_nonlinearity", "1/g", x=0.01, y=0.0, z=0.02), "x 1.00, z 2.00 % per g"),
        (of("saturation", "m/s^2", ((1.0, 2.0), (3.0, 4.0)), limit=39.2), "of 39.2 m/s², 2 times"),
        (of("gps_fault", "m/s", ((10.0, 25.0),), offset=4.0), "by 4.0 m/s, 15 s in all"),
        (of("gps_fault", "s", ((10.0, 25.0),), duration=15.0), "15 s in all"),
    ],
)  # fmt: skip
def test_sizes_are_said_as_people_say_them(made, said):
    assert size_of(made) == said


@pytest.mark.parametrize("name", sorted(k.effect for k in kinds()))
def test_every_effect_can_be_said_with_and_without_a_known_size(name):
    known = of(name, "m/s^2", ((1.0, 2.0),), x=0.3, y=0.1)
    assert sized(known).startswith(title_of(name))
    unknown = effect(name, unknowns={"x": Quantity(NAN, NAN, "m/s^2")})
    assert "nan" not in sized(unknown)


def test_a_jump_says_when_and_leaves_out_axes_that_did_not_jump():
    jump = effect(
        "bias_step",
        unknowns={
            "time": Quantity(187.6, 0.5, "s"),
            "x": Quantity(0.353, 0.002, "m/s^2"),
            "y": Quantity(0.001, 0.002, "m/s^2"),
        },
    )
    assert sized(jump) == "The offset jumped at 188 s by x 0.353 m/s²"


def test_the_headline_names_what_was_found():
    late, tilt = effect("gps_latency"), effect("mount_tilt")
    assert headline(diagnosis(effects=(late, tilt))) == (
        "GPS is late, and the accelerometer is tilted against the attitude"
    )
    assert headline(diagnosis(verdict=Verdict.PARTLY_EXPLAINED)).endswith("else is missing")
    three = headline(diagnosis(effects=(late, tilt, effect("bias_ramp"))))
    assert three.endswith("and one more effect")


def test_a_formula_without_a_name_is_no_finding():
    unnamed = effect("empirical", formula="throttle * w_z")
    d = diagnosis(verdict=Verdict.UNEXPLAINED, effects=(unnamed,))
    assert "no known effect" in headline(d)
    assert "throttle * w_z" in missing(d)[0]


@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_has_words_for_everything(verdict):
    effects = () if verdict in (Verdict.CLEAN, Verdict.INSUFFICIENT) else (effect(),)
    d = diagnosis(verdict=verdict, effects=effects)
    assert headline(d)
    assert missing(d)
    assert proof(d)
    assert cures(d)


def test_parameters_are_left_out_where_they_are_not_the_autopilots():
    ours = diagnosis()
    assert "GPS1_DELAY_MS" in cures(ours, advice_on(ours))[0]
    other = diagnosis(effects=(effect(cure="tell it the delay"),))
    assert cures(other) == ["Tell it the delay."]


def test_what_needs_no_cure_says_so():
    held = effect("gps_latency", cure="none: the driver takes it", parameters={})
    assert cures(diagnosis(effects=(held,))) == ["Nothing: the driver takes it."]


def test_what_is_not_all_is_never_called_noise():
    d = diagnosis(verdict=Verdict.PARTLY_EXPLAINED)
    assert d.mismatch.held_out_after < 1.1
    assert "which is no more than noise" not in proof(d)
    assert "contradict each other" in missing(d)[-1]
    assert "which is no more than noise" in proof(diagnosis())


def test_the_note_is_sorted_into_what_to_fly_and_the_rest():
    d = diagnosis(
        verdict=Verdict.PARTLY_EXPLAINED,
        note="what was found does not explain all of the residual. the flight contradicts itself: "
        "something is missing from the model, see onboard explain. x scale is not excited enough: "
        "brake hard. a remark.",
    )
    assert to_fly(d) == ["x scale is not excited enough: brake hard."]
    assert [r for r in remarks(d) if "fixes" not in r] == ["a remark."]


def test_what_is_dangerous_is_named_first_and_told_with_what_to_do():
    clipped = effect("saturation", unknowns={"limit": Quantity(78.5, 0.0, "m/s^2")})
    d = diagnosis(effects=(effect(), effect("bias_ramp"), effect("cross_axis"), clipped))
    assert headline(d).startswith("The accelerometer hit its limit")
    (said,) = dangers(d)
    assert said.startswith("The accelerometer hit its limit: ")
    assert said.endswith("Do not fly before it is cured.")
    assert severity(d) == "error"
    assert dangers(diagnosis()) == []


def test_an_accelerometer_that_died_in_flight_is_said_first_and_is_a_danger():
    d = diagnosis(effects=(effect(),), unused=(Unused(80.0, 140.0, "imu_stuck"),))
    assert headline(d).startswith("The accelerometer repeated one reading in flight. ")
    assert headline(d).endswith(headline(diagnosis(effects=(effect(),))))
    (said,) = dangers(d)
    assert said.endswith("Do not fly before it is cured.")
    assert severity(d) == "error"
    others = diagnosis(unused=(Unused(80.0, 140.0, "few_satellites"),))
    assert dangers(others) == []
    # What is told of the six beside it is right, and has the word with it.
    assert "from 80 s on, for 60 s" in judged(d).diagnosis.calibration.note


def test_moments_that_were_not_used_are_said_once_each():
    moments = tuple(Unused(t, t + 0.1, "few_satellites") for t in (13.0, 13.2, 40.1, 57.6, 71.0))
    (said,) = unused_in_words(diagnosis(unused=moments))
    assert said.startswith("About a second of flight was not used (at 13 s, at 40 s, at 58 s and 1")
    long = (Unused(10.0, 14.0, "few_satellites"), Unused(20.0, 20.2, "few_satellites"))
    (said,) = unused_in_words(diagnosis(unused=long))
    assert said.startswith("4 s of flight were not used (10 to 14 s, at 20 s; ")


def test_a_glitch_is_not_said_to_be_of_the_velocity_alone():
    """A position that leaps away from its velocity is one as well."""
    assert "velocity" not in DISTRUST[Distrust.GPS_GLITCH.value]
