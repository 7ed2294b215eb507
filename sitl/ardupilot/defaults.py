"""Parameters that make a bare SITL binary fly: frame, compass, tuning, small offsets.

A binary started with ``-w`` has ArduPilot's defaults for hardware that nobody has set up.
"""

from __future__ import annotations

from collections.abc import Mapping

COMMON: Mapping[str, float] = {
    "BATT_MONITOR": 4,
    "COMPASS_OFS_X": 5,
    "COMPASS_OFS_Y": 13,
    "COMPASS_OFS_Z": -18,
    "COMPASS_OFS2_X": 5,
    "COMPASS_OFS2_Y": 13,
    "COMPASS_OFS2_Z": -18,
    "COMPASS_OFS3_X": 5,
    "COMPASS_OFS3_Y": 13,
    "COMPASS_OFS3_Z": -18,
    "FS_GCS_ENABLE": 0,
    # Not exactly zero: an accelerometer whose offsets are zero counts as uncalibrated.
    "INS_ACCOFFS_X": 0.001,
    "INS_ACCOFFS_Y": 0.001,
    "INS_ACCOFFS_Z": 0.001,
    "INS_ACCSCAL_X": 1.001,
    "INS_ACCSCAL_Y": 1.001,
    "INS_ACCSCAL_Z": 1.001,
    "INS_ACC2OFFS_X": 0.001,
    "INS_ACC2OFFS_Y": 0.001,
    "INS_ACC2OFFS_Z": 0.001,
    "INS_ACC2SCAL_X": 1.001,
    "INS_ACC2SCAL_Y": 1.001,
    "INS_ACC2SCAL_Z": 1.001,
}

COPTER: Mapping[str, float] = {
    "FRAME_CLASS": 1,
    "FRAME_TYPE": 0,
    "FS_THR_ENABLE": 0,
    "FENCE_ENABLE": 0,
    "MOT_THST_EXPO": 0.65,
    "MOT_THST_HOVER": 0.39,
    "MOT_BAT_VOLT_MIN": 9.6,
    "MOT_BAT_VOLT_MAX": 12.8,
    "ATC_RAT_YAW_P": 0.3,
    "ATC_RAT_YAW_I": 0.02,
}

PLANE: Mapping[str, float] = {
    "AIRSPEED_CRUISE": 22,
    "AIRSPEED_MAX": 30,
    "AIRSPEED_MIN": 10,
    "ARSPD_PIN": 1,
    "ARSPD_BUS": 2,
    "ARSPD_USE": 1,
    "FBWB_CLIMB_RATE": 4,
    "INS_GYR_CAL": 0,
    "KFF_RDDRMIX": 0.5,
    "PTCH_LIM_MAX_DEG": 25,
    "PTCH_LIM_MIN_DEG": -20,
    "PTCH_RATE_D": 0.007265,
    "PTCH_RATE_FF": 0.595723,
    "PTCH_RATE_I": 0.11,
    "PTCH_RATE_P": 0.15,
    "PTCH2SRV_RLL": 1,
    "PTCH2SRV_TCONST": 0.25,
    "RC_OVERRIDE_TIME": 10,
    "RLL_RATE_D": 0.01743,
    "RLL_RATE_FF": 0.237212,
    "RLL_RATE_I": 0.25,
    "RLL_RATE_P": 0.3,
    "RLL2SRV_TCONST": 0.25,
    "ROLL_LIMIT_DEG": 50,
    # SITL's motor stands still at 1000; at the firmware's 1100 the aeroplane rolls away.
    "SERVO3_MAX": 2000,
    "SERVO3_MIN": 1000,
    "THR_FAILSAFE": 0,
    "THR_MAX": 100,
    "TRIM_THROTTLE": 50,
    "WP_LOITER_RAD": 80,
}


def defaults_text(vehicle: str, more: Mapping[str, float] | None = None) -> str:
    """A defaults file for ``--defaults``; ``more`` counts before what stands here."""
    values = {**COMMON, **(PLANE if vehicle == "plane" else COPTER)}
    for channel in range(1, 9):
        values |= {f"RC{channel}_MIN": 1000, f"RC{channel}_MAX": 2000}
        values[f"RC{channel}_TRIM"] = 1000 if (vehicle, channel) == ("plane", 3) else 1500
    values |= more or {}
    return "".join(f"{name} {value:g}\n" for name, value in values.items())
