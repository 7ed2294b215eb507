"""A replay as tables and plain sentences that fit into 80 columns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from onboard.answers.advice import Advice
from onboard.answers.answer import Answer
from onboard.answers.knowledge import ROUGHLY, TOGETHER, YES, calibrated, seen
from onboard.answers.replay import Replay
from onboard.answers.verdict import LACKING, about_six
from onboard.answers.words import AUTOPILOTS
from onboard.cli.flights_table import flights
from onboard.core.estimate.comparison import Comparison
from onboard.core.estimate.result import SIX_NAMES, Calibration, Estimate, Status
from onboard.core.maths.accelerometer import parameter_names

STATUS_WORDS = {
    Status.CALIBRATED: ("calibrated", "bold green"),
    Status.COLLECTING: ("not enough data yet", "bold yellow"),
    Status.INSUFFICIENT: ("the flight does not show enough", "bold yellow"),
    Status.INVALID: ("no valid result", "bold red"),
}
UNKNOWN = "-"
KNOWN_STYLE = {YES: "green", ROUGHLY: "cyan", TOGETHER: "cyan"}


def replay_report(result: Replay) -> Iterator[RenderableType]:
    """What a replay prints, part by part."""
    yield _recordings(result)
    for answer, advice in zip(result.answers, result.advice, strict=True):
        calibration = answer.calibration
        yield Text()
        yield _headline(answer)
        yield _six(calibration, result.autopilot, advice)
        if answer.flights:
            yield from flights(answer.flights)
            yield Text()
        each = [
            ("timing", f"{f.name}: {said}")
            for f in answer.flights
            if f.given is not None and (said := "; ".join(_timing(f.given.calibration.timing)))
        ]
        yield _sentences([*each, *_about(calibration, result.autopilot, advice)])
    if result.comparison is not None:
        yield Text()
        yield Text("Accelerometers compared: mean difference in flight, m/s^2")
        yield _pairs(result.comparison)


def _recordings(result: Replay) -> RenderableType:
    kind = AUTOPILOTS.get(result.autopilot, "an unknown autopilot")
    rows: list[tuple[str, str]] = []
    for recording in result.recordings:
        rows.append(("recording", f"{recording.path.name}: {kind}, {recording.duration_s:.0f} s"))
        rows += [("damage", note) for note in recording.damage]
        rows += [("note", note) for note in recording.notes]
    rows += [("note", note) for note in result.notes]
    return _sentences(rows)


def _headline(answer: Answer) -> Text:
    calibration = answer.calibration
    words, style = STATUS_WORDS[calibration.status]
    if calibration.status is Status.CALIBRATED:
        words = calibrated(calibration)
    elif calibration.status is Status.INSUFFICIENT and answer.missing:
        words = LACKING
    return Text.assemble(f"Accelerometer {calibration.imu}: ", (words, style))


def _six(calibration: Calibration, autopilot: str, advice: Advice | None) -> Table:
    """The six numbers: in force, estimate, sigma, and the parameter that takes the estimate."""
    c = calibration
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("", no_wrap=True)
    for header in ("in force", "estimate", "sigma"):
        table.add_column(header, justify="right", no_wrap=True)
    to_set = {} if advice is None else advice.to_set()
    if to_set:
        table.add_column("set to", justify="right", no_wrap=True)
    table.add_column("parameter", no_wrap=True)
    table.add_column("known", no_wrap=True)
    names = parameter_names(c.imu).six if autopilot != "px4" else (UNKNOWN,) * 6
    rows = zip(
        SIX_NAMES,
        c.in_force_scale + c.in_force_offset,
        c.scale + c.offset,
        c.scale_sigma + c.offset_sigma,
        names,
        seen(c),
        strict=True,
    )
    for name, before, value, sigma, parameter, observed in rows:
        digits = 4 if "scale" in name else 3
        table.add_row(
            name,
            _fixed(before, digits) if c.parameters_known else UNKNOWN,
            _fixed(value, digits),
            _fixed(sigma, digits),
            *([_fixed(to_set[parameter], digits) if parameter in to_set else ""] if to_set else ()),
            parameter,
            Text(observed, KNOWN_STYLE.get(observed, "yellow")),
        )
    return table


def _pairs(comparison: Comparison) -> Table:
    """Each axis of each pair: what is left of the difference with each set of parameters."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("", no_wrap=True)
    for header in ("in force", "estimates", "pair itself", "sigma", "chi2 of 3"):
        table.add_column(header, justify="right", no_wrap=True)
    for pair in comparison.pairs:
        rows = zip("xyz", pair.in_force, pair.estimated, pair.own, pair.own_sigma, strict=True)
        for axis, *values in rows:
            label = f"{pair.imus[0]} less {pair.imus[1]}, {axis}"
            together = _fixed(pair.chi_square, 1) if axis == "x" else ""
            table.add_row(
                label, *(_fixed(v, 3) for v in values[:3]), _fixed(values[3], 4), together
            )
    return table


def _about(
    calibration: Calibration, autopilot: str, advice: Advice | None
) -> Iterator[tuple[str, str]]:
    """Label and sentence of everything else that is known about one accelerometer."""
    c = calibration
    if advice is not None:
        yield "to do", about_six(advice)
        for name, condition in advice.conditions.items():
            yield "holds", f"{name} {condition}"
    if not c.parameters_known and autopilot != "px4":
        yield (
            "parameters",
            "not in the recording; scale 1 and offset 0 are assumed to be in force",
        )
    if timing := "; ".join(_timing(c.timing)):
        yield "timing", timing
    trusted = f"{c.trusted_s:.0f} s of GPS"
    if c.rejected:
        trusted += ", not used: " + ", ".join(
            f"{name.replace('_', ' ')} {n}" for name, n in sorted(c.rejected.items())
        )
    yield "trusted", trusted
    if math.isfinite(c.velocity_rms_before) and math.isfinite(c.velocity_rms_after):
        before, after = c.velocity_rms_before, c.velocity_rms_after
        yield "residual", f"velocity {before:.2f} m/s as it is, {after:.2f} m/s calibrated (RMS)"
    if math.isfinite(c.held_out_before) and math.isfinite(c.held_out_after):
        change = f"{c.held_out_before:.2f} before, {c.held_out_after:.2f} after"
        yield "check", f"{change}, in units of the noise, on parts that the fit did not see"
    if c.certificate is not None:
        window, bound = c.certificate.window_s, c.certificate.uniform_bound
        seen = f"{c.certificate.observed_max:.2f} m/s was seen"
        yield "certificate", f"velocity error below {bound:.2f} m/s over {window:.0f} s; {seen}"
    if c.dead_reckoning is not None and c.dead_reckoning.windows:
        d = c.dead_reckoning
        drift = f"{d.drift_before:.1f} m/s as it is, {d.drift_after:.1f} m/s calibrated"
        yield (
            "without GPS",
            f"velocity off after {d.horizon_s:.0f} s: {drift} ({d.windows} windows)",
        )
    if (r := c.at_rest) is not None:
        off = f"{r.in_force:+.3f} m/s^2 as it is, {r.estimate:+.3f} ± {r.sigma:.3f} calibrated"
        yield "at rest", f"off gravity by {off} (it stood for {r.seconds:.0f} s, not in the fit)"
    coverage = f"{c.coverage.percent:.0f} %"
    if c.coverage.weakest:
        coverage += f", weakest: {c.coverage.weakest}"
    yield "coverage", coverage
    if c.coverage.advice and c.coverage.advice not in c.note:
        yield "advice", c.coverage.advice
    if c.note:
        yield "note", c.note


def _timing(timing: dict[str, Estimate]) -> Iterator[str]:
    phrases = {
        "gps_delay_s": "GPS is {} ms late",
        "gps_smoothing_window_s": "it averages over {} ms",
        "imu_delay_s": "the attitude is {} ms late against the accelerometer",
    }
    for name, phrase in phrases.items():
        estimate = timing.get(name)
        if estimate is not None and math.isfinite(estimate.value):
            spread = f" ± {1e3 * estimate.sigma:.0f}" if math.isfinite(estimate.sigma) else ""
            yield phrase.format(f"{round(1e3 * estimate.value)}{spread}")


def _sentences(rows: Iterable[tuple[str, str]]) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column(overflow="fold")  # a file's name may be longer than a line
    last = None
    for label, text in rows:
        grid.add_row(label if label != last else "", Text(text))
        last = label
    return grid


def _fixed(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else UNKNOWN
