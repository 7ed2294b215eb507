"""Assembles batches of flight from the tracks of all streams."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.airborne import STILL_RATE_RAD_S, still
from onboard.core.inputs.gaps import beside_gaps, mean_step, needed_of, pieces_of
from onboard.core.inputs.gyroscopes import rates_at
from onboard.core.inputs.limits import (
    ATTITUDE_MARGIN_S,
    FELT_M_S2,
    FEWEST_FIXES,
    FEWEST_SAMPLES,
    FLYING_M_S,
    IMU_GAP_S,
    KEPT_S,
    LEAST_LAG_S,
    LEAST_WAITING_S,
    LONGEST_ROLL_S,
    MOST_STUCK,
    ROLLED_OUT_S,
    SAME_M_S2,
    SAME_RAD_S,
    SLOWEST_IMU_HZ,
    THROTTLE_STEP,
    TOUCHED_S,
)
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.reach import FAR, Reach
from onboard.core.inputs.reported_attitude import Attitudes, ReportedAttitude
from onboard.core.inputs.rolling import Rolling
from onboard.core.inputs.rounded import unrounded
from onboard.core.inputs.samples import GpsFix
from onboard.core.inputs.segments import Batch, Fixes, Segment
from onboard.core.inputs.streams import Streams
from onboard.core.inputs.stuck import stuck
from onboard.core.inputs.tracks import ImuTrack
from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class AssemblySettings:
    """How flight is cut.

    Attributes:
        batch_s: length of flight that is processed at once, s.
        slowest_imu_hz: inertial streams below this rate cannot be integrated.
    """

    batch_s: float = 10.0
    slowest_imu_hz: float = SLOWEST_IMU_HZ


class Assembly:
    """Cuts batches out of the streams.

    Attributes:
        streams: tracks of all streams, to be fed.
        standing_s: time between fixes on the ground, s: nothing of it is handed out.
        stuck: by accelerometer, from and to when it repeated one reading, s: nor is that.
    """

    def __init__(self, settings: AssemblySettings) -> None:
        """Take the settings."""
        self._settings = settings
        self.streams = Streams()
        self.standing_s = 0.0
        self.stuck: dict[int, list[tuple[float, float]]] = {}
        self._of_this_boot: set[int] = set()  # of which the last time is of this boot
        self._continues: dict[int, float] = {}  # time of the last fix that was handed out
        self._gyro: dict[int, int] = {}  # whose gyroscope was used there
        self._rolling = Rolling()

    def forget(self, imu: int) -> None:
        """Forget what waits of one accelerometer, but not what was refused of it."""
        self.streams.forget_imu(imu)
        self._continues.pop(imu, None)

    def clear(self) -> None:
        """Forget all that waits (reboot)."""
        self.streams.clear()
        self._continues.clear()
        self._of_this_boot.clear()
        self._rolling.forget()

    def take(
        self,
        parameters: ParametersInForce,
        *,
        everything: bool = False,
        grounded: bool | None = False,
        touched: float = np.inf,
    ) -> dict[int, list[Batch]]:
        """Batches of flight that are complete, by accelerometer; empty most of the time.

        Where an autopilot says whether it has landed, the last seconds of flight wait for its word,
        and so does what is still: of that it is heard later.

        Args:
            parameters: in force.
            everything: do not wait for a whole batch.
            grounded: whether the vehicle stands (then nothing is handed out); None: nobody says,
                the motion decides.
            touched: when it may have touched the ground, s; the rest waits for what stands.
        """
        waiting = self.streams.fixes
        least = LEAST_WAITING_S if everything else self._settings.batch_s
        if len(waiting) < 2 or waiting.last - waiting.first < least:
            return {}
        self.streams.settle()
        live, reach = self.streams.live, waiting.reach
        ready = self._ready(reach, everything=everything, grounded=grounded, touched=touched)
        if min(ready, waiting.last) - waiting.first < least:
            return {}
        taken, trusted, t = waiting.take(ready)
        if len(taken) < 2:
            return {}
        fixes = _fixes(taken, t)
        out: dict[int, list[Batch]] = {}
        first, end = self._flown(live, fixes, grounded=grounded)
        if first > 0:
            self._continues.clear()  # what flies after it begins anew
        flight, believed = fixes.between(first, end), trusted[first:end]
        pieces = list(pairwise(_edges(flight.t, self._settings.batch_s))) if first < end else []
        for imu in live:
            batches = [
                batch
                for a, b in pieces
                for batch in self._cut(
                    imu, live, flight.between(a, b + 1), believed[a : b + 1], parameters, reach
                )
            ]
            if batches:
                out[imu] = batches
        if end < len(t):
            self._continues.clear()
        flown = float(t[end - 1] - t[first]) if first < end else 0.0
        self.standing_s += float(t[-1] - t[0]) - flown
        self.streams.drop_before(float(t[-1]) - FAR.before - KEPT_S)
        return out

    def _ready(
        self, reach: Reach, *, everything: bool, grounded: bool | None, touched: float
    ) -> float:
        """Until when fixes may be handed out: samples are there, and the ground is known, s."""
        live = self.streams.live.values()
        ready = min((track.last for track in live), default=-np.inf) - reach.ahead
        if grounded is False and not everything:
            return min(ready - TOUCHED_S, self._stood(reach))
        if grounded is False and touched < np.inf:
            return min(ready, touched, self._stood(reach))
        if grounded is None and not everything:
            return min(ready, self._rolling.held(*self.streams.fixes.motion(ready)))
        return ready

    def _stood(self, reach: Reach) -> float:
        """Until when nothing is of the ground on which it stands now, s; inf if it does not.

        What is still right before the word that it has landed is on the ground, for a hover comes
        down first.  A fix from then on is of the touch-down, by its latency and by what it is
        averaged over, and so are samples that are needed after one before.
        """
        fixes = self.streams.fixes
        stands = ROLLED_OUT_S <= fixes.last - fixes.moved < LONGEST_ROLL_S
        return fixes.moved - reach.before - reach.ahead if stands else np.inf

    def _flown(
        self, live: dict[int, ImuTrack], fixes: Fixes, *, grounded: bool | None
    ) -> tuple[int, int]:
        """First and last (excluded) of the fixes that were in the air."""
        if grounded or (grounded is None and _still(live, fixes)):
            self._rolling.stands(fixes.t, fixes.height)
            return len(fixes), len(fixes)
        if grounded is None:
            return self._rolling.flight(fixes)
        self._rolling.flies()
        return 0, len(fixes)

    def _cut(
        self,
        imu: int,
        live: dict[int, ImuTrack],
        fixes: Fixes,
        trusted: NDArray[np.bool_],
        parameters: ParametersInForce,
        reach: Reach,
    ) -> list[Batch]:
        """Batches of one accelerometer: pieces without inertial gaps, from a trusted fix on."""
        stamps, rows = self._measured(imu, live, fixes)
        if len(stamps) < FEWEST_SAMPLES or len(self.streams.recorded) < 2:
            return []
        if self._settings.slowest_imu_hz * mean_step(stamps) > 1.0:
            return []
        t = stamps - parameters.imu_delay
        # The last one is the first of the next piece; samples that are there and stuck are no gap.
        there = live[imu].arrays()[0] - parameters.imu_delay
        lost = beside_gaps(there, fixes.t[:-1], reach) & trusted[:-1]
        live[imu].refused["imu_gap"] += int(np.count_nonzero(lost))
        out: list[Batch] = []
        for needed, inside in pieces_of(t, fixes.t, reach):
            gyro, turning = _with_rates(imu, live, stamps[needed], rows[needed], parameters)
            # Another gyroscope has another bias: the filter's belongs to the one before.
            same = self._gyro.get(imu, gyro) == gyro
            fresh = not same or self._continues.get(imu) != float(fixes.t[inside[0]])
            known = fixes.t[inside] >= self.streams.recorded.first + reach.before
            good = inside[trusted[inside] & known]
            # Flight without a fix to be believed goes on inertially, if anything went before.
            if fresh and len(good) == 0:
                continue
            # A filter can only start where GPS is to be believed.
            first = int(good[0]) if fresh else int(inside[0])
            last = int(inside[-1])
            if last - first + 1 < FEWEST_FIXES:
                continue
            chosen = fixes.between(first, last + 1)
            followed = gyro == parameters.attitude_imu
            cut = needed_of(t[needed], chosen.t, reach)
            segment = self._segment(
                t[needed[cut]], turning[cut], parameters, imu, followed=followed
            )
            out.append(Batch(segment, chosen, trusted[first : last + 1], fresh))
            self._continues[imu], self._gyro[imu] = float(fixes.t[last]), gyro
        return out

    def _measured(self, imu: int, live: dict[int, ImuTrack], fixes: Fixes) -> tuple[Array, Array]:
        """The samples without those of an accelerometer that repeats one reading."""
        stamps, rows = live[imu].arrays()
        dead = stuck(stamps, rows[:, 3:6], SAME_M_S2)
        if not np.any(dead) or not len(fixes):
            return stamps[~dead], rows[~dead]
        known = self.stuck.setdefault(imu, [])
        flown = stamps[dead & (stamps >= fixes.t[0]) & (stamps <= fixes.t[-1])]
        for piece in np.split(flown, np.flatnonzero(np.diff(flown) > IMU_GAP_S) + 1):
            if not len(piece):
                continue
            start, end = float(piece[0]), float(piece[-1])
            if imu in self._of_this_boot and start - known[-1][1] <= IMU_GAP_S:
                known[-1] = known[-1][0], max(end, known[-1][1])
            elif _moves(imu, live, fixes, start, end):
                known.append((start, end))
                self._of_this_boot.add(imu)
        del known[:-MOST_STUCK]
        return stamps[~dead], rows[~dead]

    def _segment(
        self,
        t: Array,
        rows: Array,
        parameters: ParametersInForce,
        imu: int,
        *,
        followed: bool,
    ) -> Segment:
        """Samples with the gyroscope on the accelerometer's times."""
        # Not views: they would keep the temperature of every sample alive.
        t, w_b, raw_s = t.copy(), rows[:, :3].copy(), rows[:, 3:6].copy()
        lag = parameters.gyro_lag
        if abs(lag) > LEAST_LAG_S:
            shifted = np.clip(t + lag, t[0], t[-1])
            w_b = np.stack([np.interp(shifted, t, w_b[:, j]) for j in range(3)], axis=-1)
        t_attitude, angles = self.streams.recorded.around(
            float(t[0]) - ATTITUDE_MARGIN_S, float(t[-1]) + ATTITUDE_MARGIN_S
        )
        slow = self.streams.slow_arrays(imu)
        if "throttle" in slow:
            times, told = slow["throttle"]
            slow["throttle"] = times, unrounded(times, told, THROTTLE_STEP)
        warmth = self.streams.imus[imu].warmth(t, rows[:, 6])
        if warmth is not None:
            slow["temperature"] = warmth
        return Segment(
            t,
            w_b,
            raw_s,
            t_attitude,
            _attitude(angles, parameters, self.streams),
            parameters.R_bs,
            slow,
            parameters.lever_arm(imu),
            followed,
        )


def _edges(t: Array, batch_s: float) -> list[int]:
    """Indices of first and last fixes of batches of flight at (n,) s; each ends where one begins.

    What has waited for long is cut as it would have been: after ``batch_s``, if as much is left.
    """
    edges = [0]
    while (cut := int(np.searchsorted(t, t[edges[-1]] + batch_s))) < len(t):
        if t[-1] - t[cut] < batch_s:
            break
        edges.append(cut)
    return [*edges, len(t) - 1]


def _fixes(taken: Sequence[GpsFix], t: Array) -> Fixes:
    """Fixes as arrays, at their even times ``t`` (n,)."""
    return Fixes(
        t,
        np.array([[f.v_n, f.v_e, np.nan if f.v_d is None else f.v_d] for f in taken]),
        np.array([f.altitude for f in taken]),
        np.array([f.latitude for f in taken]),
        t - np.array([f.t if f.t_message is None else f.t_message for f in taken]),
        np.array([_positive(f.speed_accuracy) for f in taken]),
        np.array([np.nan if f.t_receiver is None else f.t_receiver for f in taken]),
    )


def _positive(accuracy: float | None) -> float:
    """NaN for what is no accuracy: none, nothing, less than that."""
    return accuracy if accuracy is not None and accuracy > 0.0 else np.nan


def _moves(imu: int, live: dict[int, ImuTrack], fixes: Fixes, start: float, end: float) -> bool:
    """Whether anything else shows that an accelerometer that repeats one reading should not.

    A simulator without noise repeats itself where it stands, and where it climbs straight.
    """
    for other, track in live.items():
        stamps, rows = track.arrays()
        its = rows[(stamps >= start) & (stamps <= end)]
        if not len(its):
            continue
        turned, felt = (np.linalg.norm(np.std(its[:, k : k + 3], axis=0)) for k in (0, 3))
        if turned >= STILL_RATE_RAD_S or (other != imu and felt >= FELT_M_S2):
            return True
    near = (fixes.t >= start - 1.0) & (fixes.t <= end + 1.0)
    level = np.linalg.norm(np.nan_to_num(fixes.v_n[near, :2]), axis=1)
    return bool(np.any(level > FLYING_M_S))


def _still(live: dict[int, ImuTrack], fixes: Fixes) -> bool:
    """Whether the vehicle stands, as far as one of its gyroscopes and GPS can tell."""
    told = []
    for imu in sorted(live):
        stamps, rows = live[imu].arrays()
        during = (stamps >= fixes.t[0]) & (stamps <= fixes.t[-1])
        told.append(rows[during, :3])
        if not np.any(stuck(stamps[during], told[-1], SAME_RAD_S)):
            return still(fixes.v_n, told[-1])
    return still(fixes.v_n, told[0])


def _with_rates(
    imu: int, live: dict[int, ImuTrack], at: Array, rows: Array, parameters: ParametersInForce
) -> tuple[int, Array]:
    """Whose gyroscope it is, and rows with its rates instead of the accelerometer's own.

    One that repeats a reading has measured nothing: the next that does carries its flight.
    """
    alone = parameters.one_chip(imu)
    for gyro in sorted(live, key=lambda other: (alone and other != imu, other)):
        if gyro == imu and not np.any(stuck(at, rows[:, :3], SAME_RAD_S)):
            break
        w = None if gyro == imu else rates_at(live[gyro], at, IMU_GAP_S)
        if w is not None:
            return gyro, np.hstack([w, rows[:, 3:]])
    return imu, rows


def _attitude(angles: Array, parameters: ParametersInForce, streams: Streams) -> Attitudes:
    """Attitude of the accelerometer's body axes from the reported angles (k, 3), rad."""
    if streams.turned:
        return ReportedAttitude(angles, parameters.trim, turned=True)
    if (gain := parameters.dcm_gain) is not None:
        return ReportedAttitude(angles, parameters.trim, dcm_gain=gain)
    pitch_trim = 0.0
    if streams.over_mavlink and not int(parameters.get("FLIGHT_OPTIONS", default=0.0)) & 0x100:
        pitch_trim = float(np.deg2rad(parameters.get("PTCH_TRIM_DEG", default=0.0)))
    return ReportedAttitude(angles, parameters.trim, pitch_trim)
