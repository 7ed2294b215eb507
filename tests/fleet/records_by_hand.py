"""Records of flights as a replay would have made them, with numbers that a test says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from onboard.answers.fleet.record import Antenna, Flown, ImuRecord, Record, Said
from onboard.answers.replay_document import RecordingDocument, ReplayDocument, imu_document
from onboard.core.estimate.merged_flights import FlightSix
from onboard.core.estimate.result import Calibration, Coverage, Estimate, Status
from onboard.core.maths.accelerometer import SixParameters, linear_of
from onboard.core.maths.arrays import vector3
from onboard.recordings.provenance import Provenance

TRUE = np.array([1.012, 0.991, 1.004, 0.12, -0.2, 0.3])
SIGMA = np.array([0.002, 0.002, 0.003, 0.02, 0.02, 0.03])
DAY = 86_400.0
START = 1_700_000_000.0


def calibration(six, sigma=SIGMA, *, imu=1, known=True, delay=0.12, status=Status.CALIBRATED):
    """One accelerometer that is calibrated."""
    six, sigma = np.asarray(six, float), np.asarray(sigma, float)
    nothing = Calibration.unanswered(
        imu,
        SixParameters(),
        "",
        parameters_known=known,
        coverage=Coverage(80.0, (80.0,) * 6, "z scale", ""),
    )
    return replace(
        nothing,
        status=status,
        scale=vector3(six[:3]),
        offset=vector3(six[3:]),
        scale_sigma=vector3(sigma[:3]),
        offset_sigma=vector3(sigma[3:]),
        covariance=tuple(tuple(map(float, row)) for row in np.diag(sigma**2)),
        observable=(True,) * 6,
        trusted_s=240.0,
        timing={"gps_delay_s": Estimate(delay, 0.005), "imu_delay_s": Estimate(0.0, 0.002)},
        temperature=Estimate(30.0, 1.0),
    )


def flight(six, sigma=SIGMA):
    """What it says to others."""
    N = np.diag(1.0 / np.asarray(sigma, float) ** 2)
    return FlightSix(N, N @ linear_of(np.asarray(six, float)), N, N @ linear_of(np.asarray(six)))


def flown(
    name,
    six=TRUE,
    *,
    day=0.0,
    board="26003e000b51333031373035",
    delay=0.12,
    antenna=(0.0, 0.0, 0.0),
    sha256="",
    trusted=240.0,
    began=True,
    folder="/logs",
    why="",
    device=7,
    receiver="u-blox 000A0000",
    seed=None,
    asks=False,
    missing="",
    status=Status.CALIBRATED,
    in_force=None,
    known=True,
    asked=(),
):
    """A recording of 200 s with one accelerometer; ``seed`` adds noise of the claimed sigmas."""
    rng = np.random.default_rng(seed) if seed is not None else None
    noise = np.zeros(6) if rng is None else SIGMA * rng.standard_normal(6)
    value = np.asarray(six) + noise
    late = delay + (0.0 if rng is None else 0.005 * rng.standard_normal())
    c = replace(calibration(value, delay=late, status=status, known=known), trusted_s=trusted)
    if in_force is not None:
        c = replace(c, in_force_scale=tuple(in_force[:3]), in_force_offset=tuple(in_force[3:]))
    path = Path(folder) / name
    start = START + day * DAY
    p = Provenance(
        board=board,
        model="Pixhawk6X" if board else "",
        system=1,
        accelerometers={1: device},
        receiver=receiver,
        frame=1,
        antenna_m=(0.1, 0.0, -0.2),
        began_unix_s=start if began else None,
        ended_unix_s=start + 200.0 if began else None,
    )
    place = np.asarray(antenna) + (0.0 if rng is None else 0.02 * rng.standard_normal(3))
    document = ReplayDocument(
        recording=RecordingDocument(
            files=[str(path)], autopilot="ardupilot", duration_s=200.0, samples={"gps": 1000}
        ),
        imus=[imu_document(c)],
    )
    imu = ImuRecord(
        calibration=c,
        verdict="clean",
        effects=[],
        said=None if why else Said.of(flight(value)),
        why=why,
        antenna=Antenna([float(x) for x in place], [0.02, 0.02, 0.02]),
        asks=asks,
        missing=missing,
        asked=list(asked),
    )
    return Flown(
        path,
        name,
        Record(
            name=path.name,
            sha256=sha256 or f"{folder}/{name}",
            vehicle_kind="copter",
            provenance=p,
            imus=[imu],
            document=document,
        ),
    )
