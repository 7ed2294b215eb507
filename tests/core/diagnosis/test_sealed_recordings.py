"""Effects concealed in simulated flights of one and a half minutes and more, and their absence."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.concealing import Secret
from benchmarks.explaining import heard
from onboard.core.diagnosis.procedure import examine
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.mavlink.decode import Decoder
from sitl.builtin import effects as concealed
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.recording import FlightSpec, fly_messages

PROMPT = GpsTruth(delay=0.04, stamped_early=0.02)


def diagnosed(*flown, **flight):
    calibrator, found = examined(*flown, **flight)
    return found.diagnosis(), calibrator.first_sample


def examined(vehicle, seed, *effects, duration=110.0, imus=None, gps=PROMPT):
    spec = FlightSpec(
        vehicle=vehicle,
        seed=seed,
        duration=duration,
        imus=imus or random_imus(seed),
        gps=gps,
        effects=effects,
    )
    calibrator, decoder = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0)), Decoder()
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            calibrator.feed(sample)
    calibrator.finish()
    before = calibrator.to_bytes()
    found = examine(calibrator, 1)
    found.diagnosis()
    assert calibrator.to_bytes() == before, "a diagnosis leaves the calibrator as it is"
    return calibrator, found


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is_hidden():
    said, _ = diagnosed("copter", 41)
    assert said.verdict is Verdict.CLEAN
    assert said.effects == ()


@pytest.mark.slow
def test_a_false_velocity_is_found_from_beginning_to_end():
    fault = concealed.GpsFault(start=60.0, end=74.0, north=0.0, east=2.5)
    calibrator, found = examined("plane", 42, fault)
    said, first = found.diagnosis(), calibrator.first_sample
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    begin, end = effect.intervals[0][0] + first, effect.intervals[-1][1] + first
    assert abs(begin - fault.start) < 2.0
    assert abs(end - fault.end) < 2.0
    assert effect.unknowns["offset"].value == pytest.approx(2.5, abs=0.4)
    assert effect.where[0].axis == "earth_east"
    # Whoever goes on with the flight has its samples, and believes no fix of the fault.
    whole = calibrator.engine(1).batches
    assert [b.segment for b in found.sampled] == [b.segment for b in whole]
    t = np.concatenate([b.fixes.t for b in whole])
    inside = (t > begin) & (t < end)
    for batches, believed in ((whole, True), (found.sampled, False)):
        trusted = np.concatenate([b.trusted for b in batches])
        assert np.any(trusted[inside]) == believed
        assert np.all(trusted[(t > begin - 20.0) & (t < begin - 1.0)])


@pytest.mark.slow
def test_a_warming_offset_is_not_shared_with_the_attitude_that_it_tilts():
    # The EKF levels with the accelerometer: 1.4 m/s^2 in the first minute tilt it by degrees.
    warm = {"temperature_start": 15.0, "temperature_end": 50.0, "temperature_time": 25.0}
    imus = tuple(replace(imu, **warm) for imu in random_imus(20156))
    heating = concealed.TemperatureDrift(x=0.045, y=0.0, z=0.0)
    said, _ = diagnosed("copter", 20156, heating, imus=imus)
    (effect,) = said.effects
    assert effect.name == "temperature_drift"
    for axis, truth in zip("xyz", (heating.x, heating.y, heating.z), strict=True):
        found = effect.unknowns[axis]
        assert abs(found.value - truth) < max(0.1 * abs(truth), 3.0 * found.sigma)


@pytest.mark.slow
def test_a_very_late_attitude_leaves_nothing_over_for_other_effects():
    said, _ = diagnosed("copter", 48, concealed.ImuDelay(delay=0.09))
    (effect,) = said.effects
    assert effect.name == "imu_delay"
    assert effect.unknowns["delay"].value == pytest.approx(0.09, rel=0.04)


@pytest.mark.slow
def test_a_jump_is_placed_beside_what_does_not_change_in_flight():
    """Axes that are far from square moved it by 13 s, and an offset that grows was likelier."""
    square = concealed.CrossAxis(xy=0.022, xz=-0.034, yx=0.036, yz=-0.029, zx=-0.023, zy=-0.027)
    effects = (square, concealed.ImuDelay(delay=0.085), concealed.BiasStep(y=-0.195, time=115.0))
    said, first = diagnosed("copter", 10, *effects, duration=281.0)
    assert {e.name for e in said.effects} == {"cross_axis", "imu_delay", "bias_step"}
    jump = next(e for e in said.effects if e.name == "bias_step")
    assert jump.unknowns["time"].value + first == pytest.approx(115.0, abs=1.0)
    assert abs(jump.unknowns["y"].value + 0.195) < 3.0 * jump.unknowns["y"].sigma


@pytest.mark.slow
def test_clipping_that_the_low_pass_hides_is_found_by_its_count():
    said, _ = diagnosed("copter", 44, concealed.Saturation(limit=11.4), duration=125.0)
    effect = next(e for e in said.effects if e.name == "saturation")
    assert effect.unknowns["limit"].value == pytest.approx(11.4, rel=0.1)
    assert effect.intervals
    assert np.all(np.diff(np.array(effect.intervals)) >= 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(("vehicle", "seed"), [("copter", 62), ("plane", 65)])
def test_what_vibration_takes_over_the_rail_bends_no_number(vehicle, seed):
    """Most of the flight clips, and of most of that a low-pass leaves no sample at the rail."""
    imus = random_imus(seed)
    limit = concealed.Saturation(limit=12.5 if vehicle == "copter" else 13.2)
    said, _ = diagnosed(vehicle, seed, limit, duration=150.0, imus=imus)
    assert said.verdict is Verdict.EXPLAINED
    assert [e.name for e in said.effects if e.name != "gps_latency"] == ["saturation"]
    c, true = said.calibration, imus[0]
    off = np.subtract(c.scale + c.offset, true.scale + true.offset)
    assert np.abs(off / (c.scale_sigma + c.offset_sigma)).max() < 3.5


@pytest.mark.slow
def test_of_an_accelerometer_that_clips_all_the_time_nothing_is_known():
    said, _ = diagnosed("plane", 67, concealed.Saturation(limit=10.9), duration=110.0)
    assert "saturation" in {e.name for e in said.effects}
    c = said.calibration
    assert (c.scale, c.offset) == (c.in_force_scale, c.in_force_offset)
    assert (*c.scale_sigma, *c.offset_sigma) == c.prior_sigma
    assert c.note.count("clipped nearly all the time") == 1
    untestable = {n.name for n in said.not_testable}
    assert {"accelerometer_hysteresis", "cross_axis", "bias_ramp"} <= untestable


@pytest.mark.slow
def test_what_has_no_name_gets_none_but_its_formula():
    hidden = concealed.Nameless(term="dynamic_pressure", x=-0.2, y=-0.2, z=-0.2)
    said, _ = diagnosed("copter", 45, hidden, duration=150.0)
    assert said.verdict is Verdict.UNEXPLAINED
    (effect,) = said.effects
    assert effect.name == "empirical"
    assert "speed" in effect.formula


@pytest.mark.slow
def test_a_copters_jump_does_not_pass_for_noise_and_is_said_to_be_on_its_axis():
    # Sideways it looks like a tilt that wanders: noise found without it would be made of it.
    step = concealed.BiasStep(time=80.0, y=0.37)
    said, first = diagnosed("copter", 51, step, duration=130.0)
    (effect,) = said.effects
    assert effect.name == "bias_step"
    assert effect.where[0].axis == "body_y"
    assert abs(effect.unknowns["time"].value + first - step.time) < 2.0
    assert effect.unknowns["y"].value == pytest.approx(step.y, rel=0.1)


@pytest.mark.slow
def test_a_jump_from_which_dead_reckoning_runs_away_is_no_fault_of_the_receiver():
    step = concealed.BiasStep(time=80.0, x=0.7, y=-0.7, z=0.35)
    arm = concealed.GpsLeverArm(x=1.0, y=-0.5, z=0.3)
    said, first = diagnosed("plane", 131183, step, arm, duration=135.0)
    assert {e.name for e in said.effects} == {"bias_step", "gps_lever_arm"}
    found = next(e for e in said.effects if e.name == "bias_step")
    assert abs(found.unknowns["time"].value + first - step.time) < 2.0
    for axis in "xyz":
        assert found.unknowns[axis].value == pytest.approx(getattr(step, axis), rel=0.1)


@pytest.mark.slow
def test_a_far_antenna_does_not_make_latency_and_averaging_run_away():
    # A copter that hovers and swings: the arm accelerates the antenna more than the flight does.
    arm = concealed.GpsLeverArm(x=0.8, y=-0.5, z=-0.4)
    imus = random_imus(6)
    said, _ = diagnosed("copter", 6, arm, duration=125.0, imus=imus, gps=GpsTruth())
    found = next(e for e in said.effects if e.name == "gps_lever_arm")
    for axis in "xyz":
        q = found.unknowns[axis]
        assert abs(q.value - getattr(arm, axis)) < min(4.0 * q.sigma, 0.05)
    six = said.calibration
    off = np.subtract((*six.scale, *six.offset), (*imus[0].scale, *imus[0].offset))
    assert np.max(np.abs(off) / (*six.scale_sigma, *six.offset_sigma)) < 4.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [60, 61])
def test_averaging_that_an_antenna_could_be_instead_is_named_or_told_with_its_confounder(seed):
    # In a hover's force, 24 r / g of a squared window is an antenna r higher: such a flight is at
    # the edge of what shows it, half of them name it.
    said, _ = diagnosed("copter", seed, gps=replace(PROMPT, smoothing=0.3))
    for effect in said.effects:
        assert effect.name == "gps_smoothing"
        window = effect.unknowns["window"]
        assert abs(window.value - 0.3) < max(0.03, 3.0 * window.sigma)
    confounded = [set(a.names) for a in said.ambiguous]
    assert said.effects or any({"gps_smoothing", "gps_lever_arm"} <= c for c in confounded)


@pytest.mark.slow
def test_a_large_tilt_does_not_hide_what_the_heading_is_off_by():
    # What is left of it at the second order goes with the bank, as a heading that wanders.
    tilt, north = concealed.MountTilt(roll=-0.11, pitch=0.08), concealed.HeadingError(yaw=-0.25)
    said, _ = diagnosed("plane", 7, tilt, north, duration=200.0)
    found = {e.name: e.unknowns for e in said.effects}
    assert set(found) == {"mount_tilt", "heading_error"}
    assert found["mount_tilt"]["roll"].value == pytest.approx(tilt.roll, abs=0.006)
    assert found["mount_tilt"]["pitch"].value == pytest.approx(tilt.pitch, abs=0.012)
    yaw = found["heading_error"]["yaw"]
    assert abs(yaw.value - north.yaw) < 3.0 * yaw.sigma
    assert yaw.sigma < 0.04


@pytest.mark.slow
def test_gates_do_not_leave_out_the_flight_that_says_how_large_an_effect_is():
    # About nothing a curve of 0.05 per g looks a fifth too large.
    bent = Secret(163070, "plane", "single", ("scale_nonlinearity",), "large").spec()
    found = examine(heard(bent), 1)
    said = found.diagnosis()
    assert [e.name for e in said.effects] == ["scale_nonlinearity"]
    z = said.effects[0].unknowns["z"]
    assert abs(z.value - bent.effects[0].z) < 3.0 * z.sigma
    rows = found.evidence.final.all_blocks, found.evidence.full.all_blocks
    few, every = (sum(b.sums.rows for b in blocks) for blocks in rows)
    assert few > 0.99 * every
