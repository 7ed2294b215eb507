"""What the demonstration has shown: truth, estimate, sigma, pushed and read back; residuals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from onboard.answers.replay_document import (
    PushedDocument,
    RecordingDocument,
    ReplayDocument,
    imu_document,
)
from onboard.core.estimate.result import Calibration
from onboard.core.maths.accelerometer import SixParameters, parameter_names

if TYPE_CHECKING:
    from onboard.daemon.process.service import Service
    from onboard.daemon.view.snapshot import WrittenView
    from sitl.builtin.truth import ImuTruth

SCALE_LIMIT, OFFSET_LIMIT = 0.01, 0.05
"""How far an estimate may be from the truth; offsets in m/s^2."""
SIGMAS = 3.0
READ_BACK_LIMIT = 1e-6


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a demonstration.  Keys are accelerometers; ``written`` is the first push."""

    truth: Mapping[int, SixParameters]
    calibrations: Mapping[int, Calibration]
    written: Mapping[int, WrittenView]
    duration: float

    @classmethod
    def of(cls, service: Service, imus: Sequence[ImuTruth], duration: float) -> Outcome:
        """Collects it from the service, which goes on."""
        truth = {
            number: SixParameters(scale=imu.scale, offset=imu.offset)
            for number, imu in enumerate(imus, start=1)
        }
        learned = service.handover.learned
        return cls(
            truth=truth,
            calibrations={} if learned is None else learned.calibrations,
            written={w.imu: w for w in reversed(service.snapshot().push.written)},
            duration=duration,
        )

    @property
    def shortcomings(self) -> tuple[str, ...]:
        """What it did not show; empty when all is well."""
        return tuple(s for imu in self.truth for s in self._shortcomings(imu))

    def _shortcomings(self, imu: int) -> Iterator[str]:
        calibration, written = self.calibrations.get(imu), self.written.get(imu)
        if calibration is None:
            yield f"IMU {imu} was not calibrated"
            return
        for name, error, sigma, limit in _errors(calibration, self.truth[imu]):
            if abs(error) > limit:
                yield f"{name} is off by {error:.4f}, more than {limit}"
            if abs(error) > SIGMAS * sigma:
                yield f"{name} is off by {abs(error) / sigma:.1f} sigma"
        pushed = _pushed(written)
        if {p.name for p in pushed} != set(parameter_names(imu).six):
            yield f"IMU {imu}: not all six parameters were pushed"
        for p in pushed:
            if p.read_back is None or abs(p.read_back - p.wanted) > READ_BACK_LIMIT:
                yield f"{p.name} reads back {p.read_back}, wanted {p.wanted}"
        before, after = _residuals(written)
        if before is None or after is None or after >= before:
            yield f"IMU {imu}: the residual has not fallen"

    def document(self) -> ReplayDocument:
        """The JSON document: as of a replay, with truth and what was pushed."""
        samples = {"first_flight_s": round(self.duration)}
        return ReplayDocument(
            recording=RecordingDocument(
                files=[], autopilot="ardupilot", duration_s=self.duration, samples=samples
            ),
            imus=[
                imu_document(c, truth=self.truth[imu], pushed=_pushed(self.written.get(imu)))
                for imu, c in self.calibrations.items()
                if imu in self.truth
            ],
        )


def report(outcome: Outcome) -> Iterator[RenderableType]:
    """One table an accelerometer, its residuals, and a verdict."""
    for imu in outcome.truth:
        calibration = outcome.calibrations.get(imu)
        if calibration is None:
            continue
        yield Text()
        yield _table(outcome, imu, calibration)
        before, after = _residuals(outcome.written.get(imu))
        if before is not None and after is not None:
            yield Text(
                f"velocity residual: {before:.3f} m/s with the old parameters, "
                f"{after:.3f} m/s with the new"
            )
    yield Text()
    if outcome.shortcomings:
        yield Text("not as it should be:", style="bold red")
        yield from (Text(f"  {shortcoming}", style="red") for shortcoming in outcome.shortcomings)
    else:
        yield Text("all estimates within their limits; all parameters written", style="bold green")


def _table(outcome: Outcome, imu: int, calibration: Calibration) -> Table:
    table = Table(title=f"accelerometer {imu}", title_justify="left")
    for heading in ("parameter", "before", "truth", "estimate", "sigma", "pushed", "read back"):
        table.add_column(heading, justify="left" if heading == "parameter" else "right")
    truth = outcome.truth[imu].as_vector()
    estimate = calibration.scale + calibration.offset
    sigma = calibration.scale_sigma + calibration.offset_sigma
    pushed = {p.name: p for p in _pushed(outcome.written.get(imu))}
    for i, name in enumerate(parameter_names(imu).six):
        p = pushed.get(name)
        numbers = (
            None if p is None else p.before,
            float(truth[i]),
            estimate[i],
            sigma[i],
            None if p is None else p.wanted,
            None if p is None else p.read_back,
        )
        table.add_row(name, *("-" if x is None else f"{x:.4f}" for x in numbers))
    return table


def _errors(
    calibration: Calibration, truth: SixParameters
) -> Iterator[tuple[str, float, float, float]]:
    """Name, error, sigma, limit of each of the six."""
    estimate = calibration.scale + calibration.offset
    sigma = calibration.scale_sigma + calibration.offset_sigma
    limits = (SCALE_LIMIT,) * 3 + (OFFSET_LIMIT,) * 3
    names = parameter_names(calibration.imu).six
    for name, x, t, s, limit in zip(names, estimate, truth.as_vector(), sigma, limits, strict=True):
        yield name, x - float(t), s, limit


def _residuals(written: WrittenView | None) -> tuple[float | None, float | None]:
    """Velocity residual with the parameters in force, first flight and second, m/s."""
    if written is None:
        return None, None
    return written.velocity_rms_before_m_s, written.next_velocity_rms_m_s


def _pushed(written: WrittenView | None) -> tuple[PushedDocument, ...]:
    """What was written to one accelerometer, and read back."""
    return tuple(
        PushedDocument(name=v.name, before=v.before, wanted=v.written, read_back=v.read_back)
        for v in (() if written is None else written.values)
    )
