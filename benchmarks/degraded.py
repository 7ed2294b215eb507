"""What a poor receiver, slow streams or an old firmware cost: the same flights with less in them.

``python -m benchmarks.degraded`` takes recordings with known answers (ArduPilot SITL), removes or
spoils a part of their samples, and asks what replay asks.  Sigmas are compared with those of the
untouched recording, errors with the truth in units of the claimed sigma.  Where parameters are
removed, the samples are not raw any more, and the truth is that of what is left to calibrate.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.dcm_attitude import by_dcm
from benchmarks.recorded import WHERE, Array, Flight, answered, flown, folder, in_force, recorded
from onboard.core.estimate.result import Status
from onboard.core.inputs.samples import (
    AttitudeSample,
    EkfHealth,
    GpsFix,
    ImuSample,
    ParameterValue,
    Sample,
    VehicleState,
)
from onboard.core.maths.accelerometer import linear_of, parameters_of

RECORDINGS = ("a02.tlog", "a05.tlog", "b02.tlog", "b05.tlog", "c01.BIN")
"""Two planes and two copters as telemetry, and a log: only logs have vertical velocity."""
NOISE_M_S = 0.3
ALIASED_M_S2 = np.array([0.25, 0.65, 0.20])
"""As two real copters have it at 50 Hz, from sample to sample."""
EARLY = 0.1
"""Of a step: stamps jitter, and a sample that comes a little early is taken."""

Samples = Iterable[Sample]


@dataclass(frozen=True, slots=True)
class Loss:
    """What is lost, in words, and the samples without it."""

    name: str
    leave: Callable[[Samples], Iterator[Sample]]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What was left of a recording.

    Attributes:
        recording: its name.
        loss: what was lost.
        status: of the answer, or why there is none.
        ratio: of sigmas to those of the untouched recording, the largest of the six; NaN if there
            are none.
        median: the same, median of the six.
        sigmas: largest error of the six in claimed sigmas.
    """

    recording: str
    loss: str
    status: str
    ratio: float
    median: float
    sigmas: float


def _thinned(kind: type, rate: float) -> Callable[[Samples], Iterator[Sample]]:
    """One sample of a kind each ``1 / rate`` s, by accelerometer where there are several."""

    def leave(samples: Samples) -> Iterator[Sample]:
        last: dict[int, float] = {}
        for s in samples:
            if isinstance(s, kind):
                stream, t = getattr(s, "imu", 0), float(getattr(s, "t", 0.0))
                # A clock that was set back begins anew.
                if 0.0 <= t - last.get(stream, -math.inf) < (1.0 - EARLY) / rate:
                    continue
                last[stream] = t
            yield s

    return leave


def _without(*kinds: type) -> Callable[[Samples], Iterator[Sample]]:
    def leave(samples: Samples) -> Iterator[Sample]:
        return (s for s in samples if not isinstance(s, kinds))

    return leave


def _changed(change: Callable[[Sample], Sample]) -> Callable[[Samples], Iterator[Sample]]:
    def leave(samples: Samples) -> Iterator[Sample]:
        return map(change, samples)

    return leave


def _noisy(samples: Samples) -> Iterator[Sample]:
    """White noise on each velocity that the receiver reports."""
    rng = np.random.default_rng(1)
    last: tuple[GpsFix, GpsFix] | None = None
    for s in samples:
        if isinstance(s, GpsFix):
            if last is not None and replace(s, t=last[0].t) == last[0]:
                yield replace(last[1], t=s.t)  # a repeat stays one
                continue
            north, east, down = (float(x) for x in NOISE_M_S * rng.standard_normal(3))
            spoilt = replace(
                s,
                v_n=s.v_n + north,
                v_e=s.v_e + east,
                v_d=None if s.v_d is None else s.v_d + down,
            )
            last = (s, spoilt)
            yield spoilt
        else:
            yield s


def _vibrating(samples: Samples) -> Iterator[Sample]:
    """Vibration faster than half the sample rate, which samples fold into noise of all bands."""
    rng = np.random.default_rng(6)
    for s in samples:
        if isinstance(s, ImuSample):
            x, y, z = (float(a) for a in s.f_b + ALIASED_M_S2 * rng.standard_normal(3))
            yield replace(s, f_b=(x, y, z))
        else:
            yield s


def _old(sample: Sample) -> Sample:
    """MAVLink 1 has no extension fields: no temperature, no accuracy."""
    if isinstance(sample, ImuSample):
        return replace(sample, temperature=None)
    if isinstance(sample, GpsFix):
        return replace(sample, speed_accuracy=None)
    return replace(sample, landed=None) if isinstance(sample, VehicleState) else sample


def _no_vertical(sample: Sample) -> Sample:
    return replace(sample, v_d=math.nan) if isinstance(sample, GpsFix) else sample


def _no_height(sample: Sample) -> Sample:
    """A receiver that does not know it says the same all the time."""
    return replace(sample, altitude=0.0) if isinstance(sample, GpsFix) else sample


def _quiet_receiver(sample: Sample) -> Sample:
    """A receiver that tells nothing of its quality."""
    if not isinstance(sample, GpsFix):
        return sample
    return replace(sample, satellites=None, hdop=None, speed_accuracy=None)


def _all(name: str, *steps: Callable[[Samples], Iterator[Sample]]) -> Loss:
    """Several losses, one after the other."""

    def leave(samples: Samples) -> Iterator[Sample]:
        left: Samples = samples
        for step in steps:
            left = step(left)
        return iter(left)

    return Loss(name, leave)


LOSSES = (
    _all("nothing"),
    _all("GPS at 1 Hz", _thinned(GpsFix, 1.0)),
    _all("attitude at 10 Hz", _thinned(AttitudeSample, 10.0)),
    _all("attitude at 4 Hz", _thinned(AttitudeSample, 4.0)),
    _all("attitude by DCM", by_dcm),
    _all("attitude by DCM, 10 Hz", by_dcm, _thinned(AttitudeSample, 10.0)),
    _all("no vertical velocity", _changed(_no_vertical)),
    _all("0.3 m/s more noise of the receiver", _noisy),
    _all("no height", _changed(_no_height)),
    _all("neither height nor vertical velocity", _changed(_no_height), _changed(_no_vertical)),
    _all("inertial data at 25 Hz", _thinned(ImuSample, 25.0)),
    _all("inertial data at 10 Hz", _thinned(ImuSample, 10.0)),
    _all("vibration aliased into samples", _vibrating),
    _all("no EKF status", _without(EkfHealth)),
    _all("neither EKF status nor armed state", _without(EkfHealth, VehicleState)),
    _all("no word on GPS quality", _changed(_quiet_receiver)),
    _all("no parameters", _without(ParameterValue)),
    _all("old firmware", _without(EkfHealth, ParameterValue), _changed(_old)),
    _all(
        "GPS at 1 Hz, 0.3 m/s more noise, attitude at 4 Hz",
        _thinned(GpsFix, 1.0),
        _noisy,
        _thinned(AttitudeSample, 4.0),
    ),
)


def truth_of(flight: Flight, loss: Loss) -> Array:
    """(6,) scale and offset that are left to find for the first accelerometer."""
    truth = flight.truth[1]
    if any(isinstance(s, ParameterValue) for s in loss.leave(flight.samples)):
        return truth
    held = in_force(flight, 1)
    # f = s (raw - o) was told; S f + b is the force of the truth.
    x = linear_of(truth)
    scale = x[:3] / held[:3]
    return parameters_of(np.concatenate([scale, x[3:] + x[:3] * held[3:]]))


def outcomes(name: str, losses: Sequence[Loss]) -> Iterator[Outcome]:
    """One recording with each of the losses; the untouched one comes first."""
    flight = recorded(folder() / name)
    whole: Array | None = None
    for loss in losses:
        made = flown(loss.leave(flight.samples))
        nan = float("nan")
        if 1 not in made.imus:
            rejected = made.calibrator.trust.rejected
            why = ", ".join(f"{k} {n}" for k, n in sorted(rejected.items())) or "nothing"
            yield Outcome(name, loss.name, f"no answer ({why})", nan, nan, nan)
            continue
        given = made.answer(1)
        c = given.calibration
        sigma = np.array(c.scale_sigma + c.offset_sigma)
        whole = sigma if whole is None else whole
        error = np.array(c.scale + c.offset) - truth_of(flight, loss)
        status = c.status.value
        if c.status is not Status.CALIBRATED:
            status += f" ({given.diagnosis.verdict.value}: {c.note.split('. ')[0]})"
        yield Outcome(
            name,
            loss.name,
            status,
            float(np.max(sigma / whole)),
            float(np.median(sigma / whole)),
            float(np.max(np.abs(error) / sigma)),
        )


def main(arguments: list[str] | None = None) -> None:
    """Print one row for each recording and loss."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", nargs="*", default=RECORDINGS, help="names of files")
    parser.add_argument("--losses", nargs="*", default=[], help="parts of the names of losses")
    chosen = parser.parse_args(arguments)
    if not answered():
        print(WHERE)
        return
    wanted = [x for x in LOSSES if x.name == "nothing" or _asked(x.name, chosen.losses)]
    print("| recording | lost | sigmas, median | largest | error, sigmas | status |")
    print("|---|---|---|---|---|---|")
    for name in chosen.recordings:
        for o in outcomes(name, wanted):
            print(
                f"| {o.recording} | {o.loss} | {o.median:.2f} | {o.ratio:.2f} | {o.sigmas:.1f} | "
                f"{o.status} |",
                flush=True,
            )


def _asked(name: str, parts: Sequence[str]) -> bool:
    return not parts or any(part in name for part in parts)


if __name__ == "__main__":
    main()
