"""The parameters that the built-in autopilot has, with ArduPilot's names and defaults."""

from __future__ import annotations

from dataclasses import replace

from sitl.builtin.effects import Vector3
from sitl.builtin.params import Kind, Parameter, ParameterStore
from sitl.builtin.truth import Truth

ACCEL_STEMS = ("INS_ACC", "INS_ACC2", "INS_ACC3")
AXES = ("X", "Y", "Z")
PER_CENT = 100.0
LOOP_RATE = {"plane": 50, "copter": 400}
STREAM_RATES = {
    "RAW_SENS": 2,
    "EXT_STAT": 2,
    "RC_CHAN": 2,
    "RAW_CTRL": 0,
    "POSITION": 2,
    "EXTRA1": 4,
    "EXTRA2": 4,
    "EXTRA3": 2,
    "PARAMS": 10,
}


def initial_parameters(vehicle: str, truth: Truth, loop_rate: int | None = None) -> list[Parameter]:
    """Everything, uncalibrated: scales 1, offsets just not zero (arming refuses zero)."""
    out = [
        Parameter("FORMAT_VERSION", 13 if vehicle == "plane" else 120, Kind.INT16, read_only=True),
        Parameter("MAV_SYSID", 1, Kind.INT16),
        Parameter("SCHED_LOOP_RATE", loop_rate or LOOP_RATE[vehicle], Kind.INT16),
        Parameter("ARMING_CHECK", 1, Kind.INT32),
        Parameter("ARMING_ACCTHRESH", 0.75),
        Parameter("ARMING_REQUIRE", 1, Kind.INT8),
        Parameter("AHRS_ORIENTATION", truth.orientation, Kind.INT8),
        Parameter("AHRS_EKF_TYPE", 3, Kind.INT8),
        Parameter("AHRS_TRIM_X", 0.0),
        Parameter("AHRS_TRIM_Y", 0.0),
        Parameter("AHRS_TRIM_Z", 0.0),
        Parameter("BARO1_GND_PRESS", 94500.0, read_only=True),
        Parameter("STAT_BOOTCNT", 1, Kind.INT16, read_only=True),
        Parameter("MIS_TOTAL", 0, Kind.INT16, read_only=True),
        Parameter("GPS1_DELAY_MS", 0, Kind.INT16),
        Parameter("INS_ACCEL_FILTER", 20, Kind.INT16),
        Parameter("INS_GYRO_FILTER", 20, Kind.INT16),
    ]
    out += [Parameter(f"GPS1_POS_{a}", 0.0) for a in AXES]
    out += [Parameter(f"MAV1_{name}", rate, Kind.INT16) for name, rate in STREAM_RATES.items()]
    for index, stem in enumerate(ACCEL_STEMS):
        present = index < len(truth.imus)
        out += [Parameter(f"{stem}OFFS_{a}", 0.001 if present else 0.0) for a in AXES]
        out += [Parameter(f"{stem}SCAL_{a}", 1.0) for a in AXES]
        device = 2753028 + 8 * index if present else 0
        out.append(Parameter(f"{stem}_ID", device, Kind.INT32))
        out.append(Parameter(f"{stem}_CALTEMP".replace("ACC_", "ACC1_"), 25.0))
        out.append(Parameter(f"INS_TCAL{index + 1}_ENABLE", 0, Kind.INT8))
        out.append(Parameter("INS_USE" + ("" if index == 0 else str(index + 1)), 1, Kind.INT8))
        out += [Parameter(f"INS_POS{index + 1}_{a}", 0.0) for a in AXES]
    if truth.aircraft is not None:
        out += truth.aircraft.parameters()
    return out + _simulator(truth)


def _simulator(truth: Truth) -> list[Parameter]:
    """The truth under SITL's names; setting one changes the hardware."""
    gps = truth.gps
    out = [
        Parameter("SIM_GPS1_LAG_MS", round(gps.delay * 1000.0), Kind.INT16),
        Parameter("SIM_GPS1_HZ", gps.rate, Kind.INT8),
        Parameter("SIM_GPS1_JAM", 0, Kind.INT8),
        Parameter("SIM_GPS1_ENABLE", 1, Kind.INT8),
        Parameter("SIM_SPEEDUP", 1.0),
        Parameter("SIM_VIB_FREQ_X", truth.imus[0].vibration_hz),
        Parameter("SIM_IMUT_START", truth.imus[0].temperature_start),
        Parameter("SIM_IMUT_END", truth.imus[0].temperature_end),
        Parameter("SIM_IMUT_TCONST", truth.imus[0].temperature_time),
    ]
    out += [Parameter(f"SIM_GPS1_POS_{a}", gps.antenna[i]) for i, a in enumerate(AXES)]
    out += [Parameter(f"SIM_GPS1_GLTCH_{a}", 0.0) for a in AXES]
    at = truth.imus[0].position
    out += [Parameter(f"SIM_IMU_POS_{a}", at[i]) for i, a in enumerate(AXES)]
    for index, imu in enumerate(truth.imus):
        n = index + 1
        out += [Parameter(f"SIM_ACC{n}_SCAL_{a}", imu.scale[i]) for i, a in enumerate(AXES)]
        out += [Parameter(f"SIM_ACC{n}_BIAS_{a}", imu.offset[i]) for i, a in enumerate(AXES)]
        out.append(Parameter(f"SIM_ACC{n}_RND", imu.broadband))
        out += [
            Parameter(f"SIM_GYR{n}_SCALE_{a}", PER_CENT * imu.gyro_scale[i])
            for i, a in enumerate(AXES)
        ]
    return out


def _shares(per_cent: Vector3) -> Vector3:
    x, y, z = per_cent
    return x / PER_CENT, y / PER_CENT, z / PER_CENT


def truth_in_force(truth: Truth, parameters: ParameterStore) -> Truth:
    """The hardware as the SIM_* parameters now describe it."""
    imus = tuple(
        replace(
            imu,
            scale=parameters.vector(f"SIM_ACC{n}_SCAL_"),
            offset=parameters.vector(f"SIM_ACC{n}_BIAS_"),
            broadband=parameters[f"SIM_ACC{n}_RND"],
            gyro_scale=_shares(parameters.vector(f"SIM_GYR{n}_SCALE_")),
            position=parameters.vector("SIM_IMU_POS_") if n == 1 else imu.position,
            vibration_hz=parameters["SIM_VIB_FREQ_X"],
            temperature_start=parameters["SIM_IMUT_START"],
            temperature_end=parameters["SIM_IMUT_END"],
            temperature_time=parameters["SIM_IMUT_TCONST"],
        )
        for n, imu in enumerate(truth.imus, start=1)
    )
    always = (0.0, float("inf"))
    north, east, _ = parameters.vector("SIM_GPS1_GLTCH_")
    gps = replace(
        truth.gps,
        delay=parameters["SIM_GPS1_LAG_MS"] * 1e-3,
        rate=max(1.0, parameters["SIM_GPS1_HZ"]),
        antenna=parameters.vector("SIM_GPS1_POS_"),
        jamming=(always,) if parameters["SIM_GPS1_JAM"] else truth.gps.jamming,
        losses=truth.gps.losses if parameters["SIM_GPS1_ENABLE"] else (always,),
        glitches=((*always, north, east),) if north or east else truth.gps.glitches,
    )
    return replace(truth, imus=imus, gps=gps)
