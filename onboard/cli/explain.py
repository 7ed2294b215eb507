"""``onboard explain``: which physics does a recording have that the model lacks?"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click
from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from onboard.cli.progress import reading
from onboard.cli.replay import STANDARD_OUTPUT, write_json, write_text
from onboard.core.findings import Diagnosis, Effect, Verdict
from onboard.core.result import SIX_NAMES
from onboard.explain import Explanation
from onboard.explain import explain as explain_recordings
from onboard.report.parameters import is_qgc, parameter_text
from onboard.report.words import EFFECTS, VERDICTS

EXAMPLES = """\
\b
onboard explain flight.BIN
onboard explain flight.tlog --report flight.html --param cure.param
onboard explain flight.BIN --json - | jq '.effects[].name'
"""


@click.command(epilog=EXAMPLES)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...", type=click.Path(path_type=Path))
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON, '-': stdout.")
@click.option("--report", "report_file", metavar="FILE", help="Write one self-contained HTML page.")
@click.option(
    "--param",
    "param_file",
    metavar="FILE",
    help="Write parameters for a ground station; QGroundControl's format if FILE ends in .params.",
)
@click.option(
    "--imu",
    type=click.IntRange(1, 5),
    metavar="N",
    help="This accelerometer, 1 to 5; else the first.",
)
def explain(
    logs: tuple[Path, ...],
    json_file: str | None,
    report_file: str | None,
    param_file: str | None,
    imu: int | None,
) -> None:
    """Find the physics that a recording has and the model lacks.

    Says what is missing, how sure that is, what to change, and what this flight could not have
    shown.  Nothing is written to any autopilot.
    """
    with reading(logs, then="comparing models") as progress:
        result = explain_recordings(logs, imu=imu, progress=progress)
    if json_file is not None:
        write_json(result.document().to_json(), json_file)
    if report_file is not None:
        # jinja2 only when it is wanted.
        from onboard.report.explain import explain_html

        page = explain_html(
            result.diagnosis,
            files=result.files,
            autopilot=result.source.autopilot,
            duration_s=result.duration_s,
        )
        write_text(page, report_file)
    if param_file is not None:
        text = parameter_text(result.diagnosis, result.files, qgc=is_qgc(param_file))
        write_text(text, param_file)
    if json_file != STANDARD_OUTPUT:
        console = Console(highlight=False)
        for part in summary(result):
            console.print(part)


def summary(result: Explanation) -> Iterator[RenderableType]:
    """What a pilot reads in ten seconds."""
    d = result.diagnosis
    colour, words = VERDICTS[d.verdict]
    yield Text(f"{', '.join(result.files)}: accelerometer {d.imu}, {result.duration_s:.0f} s")
    yield Text(words, style=f"bold {colour}")
    if d.verdict is Verdict.INSUFFICIENT:
        yield Text(d.note)
        return
    if d.effects:
        yield _effects(d.effects)
        cures = [e for e in d.effects if e.cure or e.parameters]
        yield Text("What to do", style="bold")
        for e in cures:
            settings = ", ".join(f"{n} = {v:.6g}" for n, v in e.parameters.items())
            yield Text(f"  {e.name}: {e.cure}" + (f" ({settings})" if settings else ""))
    m = d.mismatch
    yield Text(
        f"Residual on data not fitted, whitened: {m.held_out_before:.2f} with six numbers only, "
        f"{m.held_out_after:.2f} with all that was found."
    )
    for a in d.ambiguous:
        yield Text(f"Not told apart: {' and '.join(a.names)}. To tell: {a.tell_apart}.")
    if d.not_testable:
        yield Text("Could not be tested: " + ", ".join(n.name for n in d.not_testable) + ".")
    yield _six(d)
    if d.note:
        yield Text(d.note)


def _effects(effects: tuple[Effect, ...]) -> Table:
    table = Table(box=None, padding=(0, 1), show_edge=False)
    table.add_column("what is missing", ratio=3)
    table.add_column("size", ratio=3)
    table.add_column("share", justify="right")
    for e in effects:
        size = ", ".join(
            f"{k} {q.value:.3g} ± {q.sigma:.1g} {q.unit}" for k, q in e.unknowns.items()
        )
        spans = "; ".join(f"{a:.0f}-{b:.0f} s" for a, b in e.intervals[:4])
        table.add_row(
            f"{EFFECTS.get(e.name, e.name)} ({e.name})",
            size + (f"; {spans}" if spans else ""),
            f"{100 * e.share_of_mismatch:.0f} %",
        )
    return table


def _six(d: Diagnosis) -> Table:
    c = d.calibration
    table = Table(box=None, padding=(0, 1), show_edge=False)
    for heading in ("", "estimate", "sigma", "in force", "seen"):
        table.add_column(heading, justify="left" if heading == "" else "right")
    rows = zip(
        SIX_NAMES,
        c.scale + c.offset,
        c.scale_sigma + c.offset_sigma,
        c.in_force_scale + c.in_force_offset,
        c.observable,
        strict=True,
    )
    for name, value, sigma, force, seen in rows:
        table.add_row(name, f"{value:.4f}", f"{sigma:.4f}", f"{force:.4f}", "yes" if seen else "no")
    return table
