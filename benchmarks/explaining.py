"""The sealed challenge: concealed effects, answers locked away before the diagnosis.

Vehicles, truths, effects and sizes are drawn by seed (:mod:`benchmarks.concealing`); the generators
(``sitl``) integrate sensor models at 1 kHz and share no code with the columns that look for the
effects.  Each recording goes the way of the command: messages of a .tlog, decoder, calibrator,
diagnosis.  Each answer is hashed, and the hash printed, before ``diagnose`` runs.
"""

from __future__ import annotations

import hashlib
import json
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.challenge import Measured, answers, kept, named, parser, summary
from benchmarks.concealing import LEVELS, Challenge, Harder, Secret
from benchmarks.numbers import (
    NUMBERS_HEAD,
    NUMBERS_LEGEND,
    Numbers,
    far_in_words,
    numbers,
    numbers_row,
)
from onboard.core.diagnosis.procedure import examine
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.maths.compiling import prefer_compiled
from onboard.core.physics.finding import Finding
from onboard.mavlink.decode import Decoder
from sitl.builtin.effects import TemperatureDrift
from sitl.recording import Flight, FlightSpec, run, sent, truth_record

TIMING = ("gps_latency", "gps_smoothing", "imu_delay")
ONSET_S = 2.0


@dataclass(frozen=True, slots=True)
class Outcome:
    """One recording's answer and what was said."""

    secret: Secret
    seal: str
    verdict: str
    found: tuple[str, ...]
    ambiguous: tuple[tuple[str, ...], ...]
    measured: tuple[Measured, ...] = ()
    onset_s: tuple[float, ...] = ()
    held_out: tuple[float, float] = (float("nan"), float("nan"))
    seconds: tuple[float, float] = (0.0, 0.0)
    numbers: tuple[Numbers, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def wanted(self) -> set[str]:
        """Names that may be said; of controls and nameless things, none."""
        return set(self.secret.names) if self.secret.kind in ("single", "pair") else set()

    @property
    def identified(self) -> bool:
        """Every concealed effect is named."""
        return self.wanted <= set(self.found)

    @property
    def false(self) -> set[str]:
        """Names that were said of nothing; a formula without a name claims none."""
        return set(self.found) - self.wanted - {"empirical", *self.secret.described}


def one(secret: Secret) -> Outcome:
    """Draw, seal, record, diagnose."""
    begun = time.process_time()
    spec = secret.spec()
    truth = truth_record(spec)
    answer = json.dumps(truth, sort_keys=True)
    seal = hashlib.sha256(answer.encode()).hexdigest()[:16]
    flight = run(spec)
    calibrator = listened(flight)
    made = time.process_time() - begun
    print(f"  sealed {seal}", file=sys.stderr, flush=True)
    begun = time.process_time()
    judge = examine(calibrator, 1)
    said = judge.diagnosis()
    took = time.process_time() - begun
    return Outcome(
        secret,
        seal,
        said.verdict.value,
        tuple(e.name for e in said.effects),
        tuple(a.names for a in said.ambiguous),
        tuple(_measured(truth, said)),
        tuple(_onsets(truth, said, calibrator)),
        (said.mismatch.held_out_before, said.mismatch.held_out_after),
        (made, took),
        tuple(numbers(judge, said, calibrator, flight)),
        {
            "truth": truth["effects"],
            "said": {
                e.name: {k: (q.value, q.sigma) for k, q in e.unknowns.items()} for e in said.effects
            },
            "formula": [e.formula for e in said.effects if e.formula],
        },
    )


def heard(spec: FlightSpec) -> Calibrator:
    """A calibrator that has listened to all of a flight."""
    return listened(run(spec))


def listened(flight: Flight) -> Calibrator:
    """The same of a flight that has been flown."""
    calibrator = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0))
    decoder = Decoder()
    for _, message in sent(flight):
        for sample in decoder.decode(message):
            calibrator.feed(sample)
    calibrator.finish()
    return calibrator


def _true_unknowns(record: dict[str, Any], truth: dict[str, Any]) -> dict[str, float]:
    match record["name"]:
        case "gps_latency":
            return {"delay": truth["net_gps_delay_s"]}
        case "gps_fault":
            return {"offset": float(np.hypot(record["north"], record["east"]))}
        case "bias_step":
            return {k: record[k] for k in "xyz"}
        case "saturation":
            return {"limit": record["limit"]}
        case "gps_overshoot":
            return {"square": record["square"]}
    skip = {"name", "imu", "reference", "square", "cube", "width", "damping"}
    return {k: float(v) for k, v in record.items() if k not in skip}


def _measured(truth: dict[str, Any], said: Diagnosis) -> Iterable[Measured]:
    by_name: dict[str, Finding] = {e.name: e for e in said.effects}
    for record in truth["effects"]:
        effect = by_name.get(record["name"])
        if effect is None:
            continue
        curved = record["name"] == TemperatureDrift.name
        if curved and (any(record["square"]) or any(record["cube"])):
            yield from _along_curve(record, effect)
            continue
        for key, true in _true_unknowns(record, truth).items():
            q = effect.unknowns.get(key)
            if q is not None:
                yield Measured(f"{record['name']}.{key}", true, q.value, q.sigma, abs(true))


def _along_curve(record: dict[str, Any], effect: Finding) -> Iterable[Measured]:
    """A curve where the flight began, half way and where it ended: what its size is has a slope."""
    curve = effect.response_curve
    if curve is None:
        return
    u = curve.x - record["reference"]
    for k, axis in enumerate("xyz"):
        true = record[axis] * u + record["square"][k] * u**2 + record["cube"][k] * u**3
        size = float(np.ptp(true))
        for at in (0, len(u) // 2, -1):
            name = f"{record['name']}.{axis} at {curve.x[at]:.0f} degC"
            value, sigma = float(curve.y[axis][at]), float(curve.sigma[axis][at])
            yield Measured(name, float(true[at]), value, sigma, size)


def _onsets(truth: dict[str, Any], said: Diagnosis, calibrator: Calibrator) -> Iterable[float]:
    """Errors of times: beginnings and ends, s."""
    late = calibrator.first_sample
    for record in truth["effects"]:
        for effect in said.effects:
            if effect.name != record["name"]:
                continue
            if effect.name == "bias_step":
                yield effect.unknowns["time"].value + late - record["time"]
            if effect.name == "gps_fault" and effect.intervals:
                delay = truth["net_gps_delay_s"]
                yield effect.intervals[0][0] + late - record["start"] - delay
                yield effect.intervals[-1][1] + late - record["end"] - delay


def _row(label: str, outcomes: list[Outcome]) -> str:
    """One line of the table."""
    sized = [named([o for o in outcomes if o.secret.level == level]) for level in LEVELS]
    if not any(o.secret.kind == "single" for o in outcomes):
        sized = ["", "", named(outcomes)]
    found = [o for o in outcomes if o.identified and o.wanted]
    all_measured = [m for o in found for m in o.measured]
    good = sum(m.right for m in all_measured)
    percent = [
        abs(m.value / m.truth - 1.0)
        for m in all_measured
        if abs(m.truth) > 0 and abs(m.truth) > 2.0 * m.sigma
    ]
    onsets = [abs(t) for o in found for t in o.onset_s]
    better = [o.held_out for o in found if np.all(np.isfinite(o.held_out)) and o.held_out[0] > 0.0]
    gain = float(np.median([1.0 - b / a for a, b in better])) if better else float("nan")
    cells = [
        f"{label:26}",
        f"{len(outcomes):10}",
        *(f"{x:8}" for x in sized),
        f"{sum(bool(o.false) for o in outcomes):5}",
        f"{100 * good / len(all_measured):6.0f} %" if all_measured else " " * 8,
        f"{100 * np.median(percent):4.1f} %" if percent else " " * 6,
        f"{np.max(onsets):4.1f} s" if onsets else " " * 6,
        f"{100 * gain:6.0f} %" if np.isfinite(gain) else " " * 8,
    ]
    return f"| {' | '.join(cells)} |"


HEAD = (
    f"| {'concealed':26} | recordings | small    | medium   | large    | false | unknowns "
    "| median | onset  | held-out |"
)
LEGEND = """\
small, medium, large: how many of them are said by their names, every one that is concealed; small
ones are at the edge of what can be found.  false: recordings of which something else is said as
well.  unknowns: within 10 % or 3 sigma.  median: relative error.  onset: largest error of a time.
held-out: median fall of the error on data that was not fitted."""


def grouped(outcomes: list[Outcome]) -> dict[str, list[Outcome]]:
    """Recordings by what is concealed, as rows of tables."""
    singles = [o for o in outcomes if o.secret.kind == "single"]
    groups = {
        name: [o for o in singles if o.secret.names[0] == name]
        for name in sorted({o.secret.names[0] for o in singles})
    }
    groups |= {
        "all single effects": singles,
        "pairs": [o for o in outcomes if o.secret.kind == "pair"],
        "outside the catalogue": [o for o in outcomes if o.secret.kind == "nameless"],
        "nothing": [o for o in outcomes if o.secret.kind == "control"],
    }
    return {label: some for label, some in groups.items() if some}


def _ruled(head: str, rows: Iterable[str]) -> str:
    return "\n".join([head, "|" + "---|" * (head.count("|") - 1), *rows])


def table(outcomes: list[Outcome]) -> str:
    """What the challenge has shown."""
    return _ruled(HEAD, (_row(label, some) for label, some in grouped(outcomes).items()))


def numbers_table(outcomes: list[Outcome]) -> str:
    """What the six are worth."""
    groups = grouped(outcomes)
    if "all single effects" in groups:
        singles = groups["all single effects"]
        groups |= {f"single, {x}": [o for o in singles if o.secret.level == x] for x in LEVELS}
    groups["all"] = outcomes
    every = {label: [n for o in some for n in o.numbers] for label, some in groups.items()}
    return _ruled(NUMBERS_HEAD, (numbers_row(k, some) for k, some in every.items() if some))


def describe(o: Outcome) -> str:
    """What went wrong with one recording."""
    hidden = json.dumps(o.details["truth"]) if o.secret.names else "nothing"
    said = {
        n: {k: f"{v:.4g}±{s:.2g}" for k, (v, s) in q.items()} for n, q in o.details["said"].items()
    }
    first = (
        f"  seed {o.secret.seed} {o.secret.vehicle} {o.secret.kind} {o.secret.level}: "
        f"hidden {hidden}, said {o.verdict} {said} {o.details['formula']} amb {o.ambiguous}"
    )
    return "\n".join([first, *(f"    {far_in_words(n)}" for n in o.numbers if n.far)])


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    options = parser("Sealed challenge of concealed effects.", count=40, first=1000)
    options.add_argument(
        "--harder", action="store_true", help="curves over the temperature, clipping beside others"
    )
    chosen = options.parse_args(arguments)
    prefer_compiled()  # as the commands do
    secrets = (Harder if chosen.harder else Challenge)(chosen.first).secrets()
    secrets = secrets[: chosen.count or len(secrets)]

    def tell(o: Outcome) -> str:
        missed = o.secret.testable and not o.identified
        return describe(o) if o.false or missed or any(n.far for n in o.numbers) else ""

    outcomes = kept(answers(one, secrets, chosen.processes), tell, chosen.save)
    print(table(outcomes))
    print(LEGEND)
    print(numbers_table(outcomes))
    print(NUMBERS_LEGEND)
    print(summary(outcomes, "diagnose"))


if __name__ == "__main__":
    main()
