"""Assembles batches of flight from the tracks of all streams."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.airborne import still
from onboard.core.inputs.gyroscopes import rates_at
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    GpsFix,
    ImuSample,
    ImuSource,
    Throttle,
    Vibration,
)
from onboard.core.inputs.segments import Batch, Fixes, Segment
from onboard.core.inputs.tracks import FixTrack, ImuTrack, SlowTrack
from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import untrimmed_rotation, untrimmed_rotation_dcm

REACH_S = 0.8
"""Inertial samples are needed this long before a fix's stamp (latency and averaging span)."""
AHEAD_S = 0.4
"""And this long after it."""
IMU_GAP_S = 0.25
"""Attitude changes too much over a longer gap to be interpolated."""


@dataclass(frozen=True, slots=True)
class AssemblySettings:
    """How flight is cut.

    Attributes:
        batch_s: length of flight that is processed at once, s.
        slowest_imu_hz: inertial streams below this rate cannot be integrated.
    """

    batch_s: float = 10.0
    slowest_imu_hz: float = 9.0


class Assembly:
    """Tracks of all streams, and the cutting of batches out of them."""

    def __init__(self, settings: AssemblySettings) -> None:
        """Take the settings."""
        self._settings = settings
        self._imus: dict[int, ImuTrack] = {}
        self._attitude = SlowTrack()
        self._slow: dict[str, SlowTrack] = {}
        self._fixes = FixTrack()
        self._over_mavlink = False
        self._fresh: dict[int, float] = {}
        self._gyro: dict[int, int] = {}
        self._R_bs: tuple[float, Array | None] = (0.0, None)
        self.standing_s = 0.0
        """Time between fixes on the ground: nothing of it is handed out."""

    def imu(self, sample: ImuSample, parameters: ParametersInForce) -> None:
        """Take an inertial sample, raw by the parameters in force now."""
        track = self._imus.get(sample.imu)
        if track is None:
            track = self._imus[sample.imu] = ImuTrack()
        orientation = parameters.get("AHRS_ORIENTATION", default=0.0)
        if orientation != self._R_bs[0]:
            self._R_bs = (orientation, parameters.R_bs)
        self._over_mavlink = sample.source is not ImuSource.LOG
        track.add(sample, parameters.six(sample.imu), self._R_bs[1])

    def attitude(self, sample: AttitudeSample) -> None:
        """Take a recorded attitude."""
        angles = (sample.roll, sample.pitch, sample.yaw)
        # All three exactly zero: an estimator that has not begun.
        if angles != (0.0, 0.0, 0.0):
            self._attitude.add(sample.t, angles)

    def slow(self, sample: Vibration | Throttle | AirData) -> None:
        """Take a signal that only diagnosis looks at."""
        if isinstance(sample, Vibration):
            name = "vibration" if sample.imu is None else f"vibration_{sample.imu}"
            self._slow.setdefault(name, SlowTrack()).add(sample.t, sample.level)
            if sample.clipping:
                counts = tuple(float(n) for n in sample.clipping)
                self._slow.setdefault("clipping", SlowTrack()).add(sample.t, counts)
        elif isinstance(sample, Throttle):
            self._slow.setdefault("throttle", SlowTrack()).add(sample.t, (sample.throttle,))
        elif sample.airspeed is not None:
            self._slow.setdefault("airspeed", SlowTrack()).add(sample.t, (sample.airspeed,))

    def fix(self, fix: GpsFix, *, trusted: bool) -> bool:
        """Take a GPS fix; False if it repeats one."""
        return self._fixes.add(fix, trusted=trusted)

    def refused(self, imu: int) -> Counter[str]:
        """What was refused, by name."""
        out = Counter(self._fixes.refused)
        # A fix repeated by a faster stream is the normal case, not a loss.
        del out["gps_repeated"]
        if imu in self._imus:
            out.update(self._imus[imu].refused)
        return out

    def forget(self, imu: int) -> None:
        """Forget what waits of one accelerometer, but not what was refused of it."""
        if imu in self._imus:
            refused = self._imus[imu].refused
            self._imus[imu] = ImuTrack()
            self._imus[imu].refused = refused
            self._fresh.pop(imu, None)

    def clear(self) -> None:
        """Forget all that waits (reboot)."""
        for imu in self._imus:
            self.forget(imu)
        self._attitude = SlowTrack()
        self._slow.clear()
        self._fixes.clear()
        self._fresh.clear()

    def take(
        self,
        parameters: ParametersInForce,
        *,
        everything: bool = False,
        grounded: bool | None = False,
    ) -> dict[int, list[Batch]]:
        """Batches of flight that are complete, by accelerometer; empty most of the time.

        Args:
            parameters: in force.
            everything: do not wait for a whole batch.
            grounded: whether the vehicle stands (then nothing is handed out); None: not told, the
                motion decides.
        """
        newest = max((track.last for track in self._imus.values()), default=-np.inf)
        live = {i: x for i, x in self._imus.items() if newest - x.last < 2.0}
        ready = min((track.last for track in live.values()), default=-np.inf) - AHEAD_S
        if len(self._fixes) < 2:
            return {}
        waiting = min(ready, self._fixes.last) - self._fixes.first
        if waiting < (0.5 if everything else self._settings.batch_s):
            return {}
        fixes, trusted, t = self._fixes.take(ready)
        if len(fixes) < 2:
            return {}
        even = Fixes(
            t,
            np.array([[f.v_n, f.v_e, np.nan if f.v_d is None else f.v_d] for f in fixes]),
            np.array([f.altitude for f in fixes]),
            np.array([f.latitude for f in fixes]),
            t - np.array([f.t if f.t_message is None else f.t_message for f in fixes]),
        )
        out: dict[int, list[Batch]] = {}
        if grounded or (grounded is None and self._still(live, even)):
            self._fresh.clear()  # what flies after it begins anew
            self.standing_s += float(t[-1] - t[0])
        else:
            for imu in live:
                batches = self._cut(imu, live, even, trusted, parameters)
                if batches:
                    out[imu] = batches
        keep = float(t[-1]) - REACH_S - 0.3
        for track in self._imus.values():
            track.drop_before(keep)
        for slow in (self._attitude, *self._slow.values()):
            slow.drop_before(keep - 1.0)
        return out

    def _still(self, live: dict[int, ImuTrack], fixes: Fixes) -> bool:
        """Whether the vehicle stands, as far as one of its gyroscopes and GPS can tell."""
        stamps, rows = live[min(live)].arrays()
        during = (stamps >= fixes.t[0]) & (stamps <= fixes.t[-1])
        return still(fixes.v_n, rows[during, :3])

    def _cut(
        self,
        imu: int,
        live: dict[int, ImuTrack],
        fixes: Fixes,
        trusted: NDArray[np.bool_],
        parameters: ParametersInForce,
    ) -> list[Batch]:
        """Batches of one accelerometer: pieces without inertial gaps, from a trusted fix on."""
        stamps, rows = live[imu].arrays()
        if len(stamps) < 8 or len(self._attitude) < 2:
            return []
        # The median: a gap does not make the rest of the stream slow.
        if self._settings.slowest_imu_hz * float(np.median(np.diff(stamps))) > 1.0:
            return []
        t = stamps - parameters.imu_delay
        breaks = np.flatnonzero(np.diff(t) > IMU_GAP_S) + 1
        out: list[Batch] = []
        for piece in np.split(np.arange(len(t)), breaks):
            if len(piece) < 8:
                continue
            begin, end = t[piece[0]], t[piece[-1]]
            inside = np.flatnonzero((fixes.t >= begin + REACH_S - 0.1) & (fixes.t <= end - 0.3))
            if len(inside) == 0:
                continue
            needed = piece[_needed(t[piece], fixes.t[inside])]
            if len(needed) < 8:
                continue
            gyro, turning = self._rates(imu, live, stamps[needed], rows[needed], parameters)
            known = fixes.t[inside] >= self._attitude.first + REACH_S
            good = inside[trusted[inside] & known]
            # Another gyroscope has another bias: the filter's belongs to the one before.
            same = self._gyro.get(imu, gyro) == gyro
            fresh = not same or self._fresh.get(imu) != float(fixes.t[inside[0]])
            # Flight without a fix to be believed goes on inertially, if anything went before.
            if fresh and len(good) == 0:
                continue
            # A filter can only start where GPS is to be believed.
            first = int(good[0]) if fresh else int(inside[0])
            last = int(inside[-1])
            if last - first < 2:
                continue
            chosen = fixes.between(first, last + 1)
            out.append(
                Batch(
                    self._segment(t[needed], turning, chosen, parameters, imu),
                    chosen,
                    trusted[first : last + 1],
                    fresh,
                )
            )
            self._fresh[imu], self._gyro[imu] = float(fixes.t[last]), gyro
        return out

    def _rates(
        self,
        imu: int,
        live: dict[int, ImuTrack],
        at: Array,
        rows: Array,
        parameters: ParametersInForce,
    ) -> tuple[int, Array]:
        """Whose gyroscope it is, and rows with its rates instead of the accelerometer's own."""
        first = min(live)
        if imu == first or parameters.one_chip(imu):
            return imu, rows
        w = rates_at(live[first], at, IMU_GAP_S)
        return (imu, rows) if w is None else (first, np.hstack([w, rows[:, 3:]]))

    def _segment(
        self, t: Array, rows: Array, fixes: Fixes, parameters: ParametersInForce, imu: int
    ) -> Segment:
        cut = _needed(t, fixes.t)
        t, rows = t[cut], rows[cut]
        w_b = rows[:, :3]
        lag = parameters.gyro_lag
        if abs(lag) > 2e-4:
            shifted = np.clip(t + lag, t[0], t[-1])
            w_b = np.stack([np.interp(shifted, t, w_b[:, j]) for j in range(3)], axis=-1)
        t_attitude, angles = self._attitude.arrays()
        slow = {name: s.arrays() for name, s in self._slow.items() if len(s) > 1}
        flat = {n: (a, x[:, 0] if x.shape[1] == 1 else x) for n, (a, x) in slow.items()}
        own = f"vibration_{imu}"
        if own in flat:
            flat["vibration"] = flat[own]
        if np.all(np.isfinite(rows[:, 6])):
            flat["temperature"] = (t[::10], rows[::10, 6])
        return Segment(
            t,
            w_b,
            rows[:, 3:6],
            t_attitude,
            self._rotation(angles, parameters),
            parameters.R_bs,
            flat,
            parameters.lever_arm(imu),
        )

    def _rotation(self, angles: Array, parameters: ParametersInForce) -> Array:
        """Attitude of the accelerometer's body axes from what was reported."""
        roll, pitch, yaw = angles.T
        # Firmware that has trims but no choice of EKF is older than the EKFs.
        old = "AHRS_TRIM_X" in parameters.values and "AHRS_EKF_TYPE" not in parameters.values
        if old or parameters.get("AHRS_EKF_TYPE", default=3.0) == 0.0:
            return untrimmed_rotation_dcm(roll, pitch, yaw, parameters.trim)
        pitch_trim = 0.0
        if self._over_mavlink and not int(parameters.get("FLIGHT_OPTIONS", default=0.0)) & 0x100:
            pitch_trim = float(np.deg2rad(parameters.get("PTCH_TRIM_DEG", default=0.0)))
        return untrimmed_rotation(roll, pitch, yaw, parameters.trim, pitch_trim)


def _needed(t: Array, epochs: Array) -> slice:
    """The samples at ``t`` that fixes at ``epochs`` need, to either side of them."""
    return slice(
        int(np.searchsorted(t, epochs[0] - REACH_S - 0.1)),
        int(np.searchsorted(t, epochs[-1] + AHEAD_S)),
    )
