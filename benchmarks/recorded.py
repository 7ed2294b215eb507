"""Recordings with known answers, and simulated flights, as lists of samples."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from onboard.answers.recorded import Recorded
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Calibration
from onboard.core.inputs.samples import GpsFix, ImuSample, ParameterValue, Sample
from onboard.mavlink.decode import Decoder
from onboard.recordings.opening import open_recording
from sitl.recording import FlightSpec, fly_messages, truth_record

Array = NDArray[np.float64]

TIMING = {"gps_latency", "gps_smoothing"}
"""Effects that the estimator itself carries; a recording with others is for ``explain``."""

WHERE = "no recordings with answers beside the project; set ONBOARD_RECORDINGS"

SCALE_LIMIT = {"copter": 0.004, "plane": 0.010}
OFFSET_LIMITS = {"copter": (0.01, 0.01, 0.04), "plane": (0.02, 0.02, 0.02)}
"""What a five-minute flight is good for, m/s^2; a copter's z offset hides behind its z scale."""


@dataclass(frozen=True, slots=True)
class Flight:
    """Samples of one flight with the truth about it.

    Attributes:
        name: file name, or what was simulated.
        vehicle: "copter" or "plane".
        samples: in order of arrival.
        truth: (6,) scale and offset (m/s^2) by accelerometer.
        delay: lateness of the GPS stamps, s.
    """

    name: str
    vehicle: str
    samples: list[Sample]
    truth: dict[int, Array]
    delay: float


def folder() -> Path:
    """Where the recordings are: ONBOARD_RECORDINGS, or beside the project."""
    beside = Path(__file__).resolve().parents[1] / ".." / "shared" / "recordings"
    return Path(os.environ.get("ONBOARD_RECORDINGS", beside)) / "sitl"


def answered() -> dict[str, Any]:
    """The answers, by name of recording; empty where there are no recordings."""
    file = folder() / "answers.json"
    if not file.is_file():
        return {}
    recordings: dict[str, Any] = json.loads(file.read_text())["recordings"]
    return recordings


def clean() -> list[Path]:
    """Recordings without physics beyond timing, streams before logs."""
    names = [n for n, a in answered().items() if not {e["name"] for e in a["effects"]} - TIMING]
    return sorted(file for name in names for file in folder().glob(f"{name}.*"))


def recorded(file: Path) -> Flight:
    """One recording with its answer."""
    answer = answered()[file.stem]
    truth = {1: np.array(answer["scale"] + answer["offset"])}
    if "imu2" in answer:
        truth[2] = np.array(answer["imu2"]["scale"] + answer["imu2"]["offset"])
    samples = list(open_recording(file).samples())
    return Flight(file.name, answer["vehicle"], samples, truth, answer["net_gps_delay_s"])


def simulated(spec: FlightSpec) -> Flight:
    """A flight of the simulated autopilot with its answer."""
    decoder = Decoder(1, 1)
    samples = [s for _, message in fly_messages(spec) for s in decoder.decode(message)]
    record = truth_record(spec)
    truth = {
        i: np.array([*imu["scale"], *imu["offset"]]) for i, imu in enumerate(record["imus"], 1)
    }
    name = f"simulated {spec.vehicle}"
    return Flight(name, spec.vehicle, samples, truth, record["net_gps_delay_s"])


def fed(samples: Iterable[Sample]) -> Calibrator:
    """The estimator of the live service at the end of the samples."""
    made = Calibrator()
    for sample in samples:
        made.feed(sample)
    made.finish()
    return made


def flown(samples: Iterable[Sample]) -> Recorded:
    """The samples as a recording that can be asked: what replay, explain and fleet answer from."""
    made = Recorded()
    for sample in samples:
        made.feed(sample)
    made.finish()
    return made


def error_of(calibration: Calibration, flight: Flight) -> Array:
    """(6,) scale and offset less the truth."""
    return np.array(calibration.scale + calibration.offset) - flight.truth[calibration.imu]


def limits(vehicle: str) -> Array:
    """(6,) what the errors of a good flight stay below."""
    return np.array([SCALE_LIMIT[vehicle]] * 3 + list(OFFSET_LIMITS[vehicle]))


def in_force(flight: Flight, imu: int) -> Array:
    """(6,) the parameters that the autopilot reported first."""
    prefix = {1: "INS_ACC", 2: "INS_ACC2"}[imu]
    found: dict[str, float] = {}
    for sample in flight.samples:
        if isinstance(sample, ParameterValue):
            found.setdefault(sample.name, sample.value)
    names = [f"{prefix}SCAL_{a}" for a in "XYZ"] + [f"{prefix}OFFS_{a}" for a in "XYZ"]
    return np.array([found.get(n, 1.0 if "SCAL" in n else 0.0) for n in names])


def moving_span(samples: list[Sample], speed: float = 2.0) -> tuple[float, float]:
    """Times (s) of the first and last fix faster than ``speed`` (m/s)."""
    t = [s.t for s in samples if isinstance(s, GpsFix) and np.hypot(s.v_n, s.v_e) > speed]
    return t[0], t[-1]


def rate_of(samples: list[Sample], imu: int = 1) -> float:
    """Inertial samples a second."""
    t = np.array([s.t for s in samples if isinstance(s, ImuSample) and s.imu == imu])
    return float(1.0 / np.median(np.diff(t)))
