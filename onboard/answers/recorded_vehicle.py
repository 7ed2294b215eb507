"""Whose recordings are read: the samples that there are, and that they are all of one vehicle."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from onboard.answers.same_flight import Track
from onboard.answers.words import DISTRUST
from onboard.core.estimate.result import Calibration, Coverage
from onboard.core.gps.distrust import Distrust
from onboard.core.inputs.blocks import Block, Piece
from onboard.core.inputs.boot_time import Boots
from onboard.core.inputs.gaps import mean_step
from onboard.core.inputs.limits import SLOWEST_IMU_HZ
from onboard.core.inputs.samples import (
    FIX_3D,
    AttitudeSample,
    GpsFix,
    ImuSample,
    ParameterValue,
)
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.core.maths.arrays import Array, Vector3
from onboard.errors import RecordingError
from onboard.recordings.recording import Recording

TIMES_LOOKED_AT = 1000
"""Of a stream, that tell how fast it is: the mean step is known to a thousandth [cost]."""
RECORD = "record it at 25 Hz or more, with attitude and GPS"
OF_THE_EKF = (Distrust.EKF_GPS_GLITCH.value, Distrust.EKF_UNHEALTHY.value)
DEVICE_IDS = {parameter_names(imu).device_id: imu for imu in (1, 2, 3, 4, 5)}


class Vehicle:
    """Counts the samples and sees to it that the accelerometers stay the same ones."""

    def __init__(self) -> None:
        self._samples: Counter[int] = Counter()
        self._first_times: defaultdict[int, list[float]] = defaultdict(list)
        self._fixes = self._placed = self._attitudes = 0
        self.standing_s = 0.0
        """Time on the ground, s."""
        self.refused: Mapping[str, int] = {}
        """Fixes that were refused, by reason, where GPS was never trusted; else empty."""
        self._parameters: dict[str, float] = {}
        self._device: dict[int, tuple[np.float32, Recording]] = {}
        self._tracks: dict[tuple[int, int], Track] = {}
        self._boot, self._boots = 0, Boots()

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Where it went: of each recording, boot and receiver."""
        return tuple(self._tracks.values())

    def begin(self) -> None:
        """Samples of another recording come next."""
        self._boot, self._boots = self._boot + 1, Boots()

    def check(self, sample: Piece, recording: Recording) -> None:
        """Take a sample, or many.

        Raises:
            RecordingError: it is of another vehicle.
        """
        if isinstance(sample, Block):
            for columns in sample.imus:
                self._count(columns.imu, columns.t)
                self._hear(columns.t)
            self._attitudes += len(sample.attitude.t)
            for other in sample.others:
                self.check(other, recording)
        elif isinstance(sample, ImuSample):
            self._count(sample.imu, (sample.t,))
            self._hear((sample.t,))
        elif isinstance(sample, AttitudeSample):
            self._attitudes += 1
        elif isinstance(sample, GpsFix):
            self._fixes += 1
            self._follow(sample, recording)
            self._placed += sample.fix_type >= FIX_3D
        elif isinstance(sample, ParameterValue) and sample.name.startswith("INS"):
            self._parameters[sample.name] = sample.value
            if sample.name in DEVICE_IDS and sample.value and float(sample.value).is_integer():
                self._check_device(sample, recording)

    def _hear(self, times: Sequence[float] | Array) -> None:
        """A recording that begins anew may be one that was put behind itself."""
        # Of many, two of the first tell another boot, and the last how far it has come.
        for t in (*times[:2], times[-1]) if len(times) > 2 else times:
            self._boot += self._boots.begins(float(t))

    def _follow(self, fix: GpsFix, recording: Recording) -> None:
        track = self._tracks.get((self._boot, fix.receiver))
        if track is None:
            track = self._tracks[self._boot, fix.receiver] = Track(recording)
        track.add(fix)

    def _count(self, imu: int, times: Sequence[float] | Array) -> None:
        self._samples[imu] += len(times)
        if len(self._first_times[imu]) < TIMES_LOOKED_AT:
            self._first_times[imu] += map(float, times[:TIMES_LOOKED_AT])

    def _check_device(self, sample: ParameterValue, recording: Recording) -> None:
        imu = DEVICE_IDS[sample.name]
        # Logs and telemetry carry identifiers as single-precision numbers.
        self._device.setdefault(imu, (np.float32(sample.value), recording))
        self._same_device(imu, np.float32(sample.value), recording)

    def _same_device(self, imu: int, device: np.float32, recording: Recording) -> None:
        known, where = self._device.get(imu, (device, recording))
        if known == device:
            return
        name = parameter_names(imu).device_id
        if where is recording:
            raise RecordingError(
                f"{recording.path}: of more than one vehicle "
                f"({name} is {known:.0f}, and later {device:.0f})"
            )
        raise RecordingError(
            f"{recording.path}: of another vehicle than {where.path} "
            f"({name} is {device:.0f}, there {known:.0f})"
        )

    def refuse(self, other: Vehicle) -> None:
        """See that others were not recordings of another vehicle.

        Raises:
            RecordingError: they name other accelerometers.
        """
        for imu, (device, recording) in other._device.items():
            self._same_device(imu, device, recording)

    @property
    def counts(self) -> dict[str, int]:
        """Samples by stream."""
        counts = {f"imu {imu}": n for imu, n in self._samples.items()}
        return counts | {"gps": self._fixes} if self._fixes else counts

    @property
    def imus(self) -> tuple[int, ...]:
        """Accelerometers that sent samples."""
        return tuple(sorted(self._samples))

    def silence(self, imu: int) -> str:
        """Why an accelerometer has no answer."""
        samples = f"accelerometer {imu}: {self._samples[imu]} samples"
        if self._slow(imu):
            return f"{samples}, fewer than {SLOWEST_IMU_HZ:g} a second; 25 are good"
        if lacking := self.lacking:
            return f"{samples}, and {lacking}"
        if self.standing_s > 0.0:
            return (
                f"{samples}, none of them in the air with trusted GPS; "
                f"the {self.standing_s:.0f} s on the ground are not used"
            )
        return f"{samples}, never together with attitude and trusted GPS"

    @property
    def lacking(self) -> str:
        """What there is none of, without which no accelerometer can be asked; empty if nothing."""
        if not self._attitudes:
            return "no attitude"
        if not self._fixes:
            return "no GPS"
        if not self._placed:
            return "no fix of the GPS receiver"
        if not self.refused:
            return ""
        reason = self._reason()
        said = DISTRUST.get(reason, reason.replace("_", " "))
        return f"no fix that can be trusted ({said}, {self.refused[reason]} fixes)"

    def _reason(self) -> str:
        """Why most fixes were refused."""
        return max(self.refused, key=lambda name: self.refused[name])

    def _slow(self, imu: int) -> bool:
        return SLOWEST_IMU_HZ * mean_step(np.array(self._first_times[imu])) > 1.0

    def unanswered(self, imu: int) -> Calibration:
        """What to say of an accelerometer of which the estimator could make nothing."""
        names = parameter_names(imu)
        in_force = SixParameters(self._three(names.scale, 1.0), self._three(names.offset, 0.0))
        empty = Calibration.unanswered(
            imu,
            in_force,
            self.silence(imu),
            parameters_known=all(name in self._parameters for name in names.six),
            coverage=Coverage(0.0, (0.0,) * 6, "", self.to_do(imu)),
        )
        return replace(empty, rejected=dict(self.refused))

    def to_do(self, imu: int) -> str:
        """What would give an accelerometer an answer."""
        if self._slow(imu):
            return RECORD
        if not self._attitudes:
            return "record the attitude as well"
        if not self._fixes:
            return "record GPS as well: what is felt is held against its velocity"
        if not self._placed:
            return "take off when the GPS receiver has a 3D fix, under an open sky"
        if self.refused:
            if self._reason() in OF_THE_EKF:
                return "see to what the autopilot's EKF complains of, and fly again"
            return "see to the GPS receiver (sky, antenna, interference), and fly again"
        if self.standing_s > 0.0:
            return "fly fast, with hard braking and turns both ways"
        return "record the whole flight: inertial samples, attitude and GPS at one time"

    def _three(self, names: tuple[str, str, str], default: float) -> Vector3:
        x, y, z = (self._parameters.get(name, default) for name in names)
        return x, y, z
