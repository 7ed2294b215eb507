"""What verdicts and effects are called when people read them."""

from __future__ import annotations

from onboard.core.findings import Verdict

VERDICTS: dict[Verdict, tuple[str, str]] = {
    Verdict.CLEAN: ("green", "Nothing is missing: six numbers and timing explain this flight."),
    Verdict.EXPLAINED: ("yellow", "Physics is missing from the model, and it was found."),
    Verdict.PARTLY_EXPLAINED: ("yellow", "Physics is missing; a part of it was found."),
    Verdict.UNEXPLAINED: ("red", "Something is missing, and nothing in the catalogue explains it."),
    Verdict.INSUFFICIENT: ("red", "This flight is too quiet to say."),
}
EFFECTS = {
    "gps_latency": "GPS is late",
    "gps_smoothing": "GPS averages its velocity",
    "gps_lever_arm": "The GPS antenna is not where the IMU is",
    "imu_delay": "Attitude and accelerometer are not simultaneous",
    "cross_axis": "The accelerometer's axes are not square",
    "mount_tilt": "Attitude and accelerometer are tilted against each other",
    "heading_error": "The heading is off",
    "heading_by_throttle": "The motors pull the compass",
    "temperature_drift": "The offset follows the temperature",
    "bias_ramp": "The offset grows with time",
    "bias_step": "The offset jumped",
    "scale_nonlinearity": "The scale changes with the load",
    "vibration_rectification": "Vibration shifts the offset",
    "throttle_coupling": "The throttle shifts the offset",
    "saturation": "The accelerometer hit its limit",
    "gps_fault": "GPS velocity was false",
    "clock_skew": "The GPS clock runs at another rate",
    "gravity": "Gravity differs",
    "load_flex": "The mount bends under load",
    "rotor_drag": "Rotor drag",
    "empirical": "An empirical term",
}
