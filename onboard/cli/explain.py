"""``onboard explain``: which physics does a recording have that the model lacks?"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from onboard.answers import verdict
from onboard.answers.advice import Advice
from onboard.answers.explain import Explanation
from onboard.answers.explain import explain as explain_recordings
from onboard.answers.knowledge import calibrated, seen
from onboard.answers.words import fixed, percent
from onboard.cli.outputs import STANDARD_OUTPUT, refuse_overwriting
from onboard.cli.progress import reading
from onboard.cli.replay import write_bytes, write_json, write_text
from onboard.cli.terminal import Terminal
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.result import SIX_NAMES, Status
from onboard.core.physics.catalogue import title_of
from onboard.core.physics.finding import Finding
from onboard.report.mcap import mcap
from onboard.report.parameters import explanation_text
from onboard.report.tracks import of_diagnosis

MOST_SPANS = 3
EXAMPLES = """\
\b
onboard explain flight.BIN
onboard explain flight.tlog --report flight.html --param cure.param
onboard explain flight.BIN --mcap flight.mcap       # for Foxglove
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
    "--mcap",
    "mcap_file",
    metavar="FILE",
    help="Write what there is over time, for Foxglove and other viewers of logs.",
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
    mcap_file: str | None,
    imu: int | None,
) -> None:
    """Find the physics that a recording has and the model lacks.

    Says what is missing, how sure that is, what to change, and what this flight could not have
    shown.  Nothing is written to any autopilot.
    """
    refuse_overwriting(logs, json_file, report_file, param_file, mcap_file)
    with reading(logs, then="comparing models") as progress:
        result = explain_recordings(logs, imu=imu, progress=progress)
    if json_file is not None:
        write_json(result.document().to_json(), json_file)
    if report_file is not None:
        # jinja2 only when it is wanted.
        from onboard.report.explain import explanation_html

        write_text(explanation_html(result), report_file)
    if param_file is not None:
        write_text(explanation_text(result, param_file), param_file)
    if mcap_file is not None:
        write_bytes(mcap(of_diagnosis(result.diagnosis)), mcap_file)
    if STANDARD_OUTPUT not in (json_file, report_file, param_file, mcap_file):
        console = Terminal(highlight=False)
        for part in summary(result):
            console.print(part)


def summary(result: Explanation) -> Iterator[RenderableType]:
    """What a pilot reads in ten seconds, and then the numbers."""
    d = result.diagnosis
    yield Text(f"{', '.join(result.files)}: accelerometer {d.imu}, {result.duration_s:.0f} s")
    yield _plain(verdict.headline(d) + ".", f"bold {verdict.COLOURS[verdict.severity(d)]}")
    yield _answers(d, result.advice)
    # After the answer, as on the page: most logs were cut off while they were written.
    yield from (Text(f"damage: {note}", "yellow") for note in result.source.damage)
    yield from (Text(f"note: {note}") for note in result.notes)
    if d.silent:
        return
    yield ""
    yield _six(d)
    yield from _limits(d)


def _answers(d: Diagnosis, advice: Advice | None) -> Table:
    """What, how sure, what to do: the same words as on the page."""
    refused = d.silent
    to_do = "To fly" if refused and not d.split else "To do"
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    found = verdict.missing(d)
    if d.effects and not refused:
        found = [f"{said[:-1]} ({named(e)})." for said, e in zip(found, d.effects, strict=False)]
        found += verdict.missing(d)[len(d.effects) :]
    rows = [
        ("Danger", verdict.dangers(d)),
        ("Missing" if verdict.lacks(d) else "To know", found),
        ("Proof", [verdict.proof(d)]),
        (to_do, verdict.cures(d, advice)),
        ("Note", verdict.remarks(d)),
    ]
    for label, sentences in rows:
        for k, sentence in enumerate(sentences):
            table.add_row("" if k else label, _plain(sentence))
    return table


def named(effect: Finding) -> str:
    """The effect's name for other programs, when it acts, and how much of the mismatch it is."""
    spans = [f"{a:.0f}-{b:.0f} s" for a, b in effect.intervals[:MOST_SPANS]]
    if len(effect.intervals) > MOST_SPANS:
        spans.append("...")
    when = f", {'; '.join(spans)}" if spans else ""
    return f"{effect.name}{when}, {percent(effect.share_of_mismatch)}"


def _limits(d: Diagnosis) -> Iterator[RenderableType]:
    """What this flight could not show."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for k, a in enumerate(d.ambiguous):
        apart = f"{' / '.join(title_of(n) for n in a.names)}. To tell: {a.tell_apart}."
        table.add_row("" if k else "Not told apart", _plain(apart))
    for k, sentence in enumerate(verdict.to_fly(d)):
        table.add_row("" if k else "Not shown", _plain(sentence))
    if d.not_testable:
        names = dict.fromkeys(title_of(n.name) for n in d.not_testable)
        table.add_row("Not tested", _plain("; ".join(names) + "."))
    if table.row_count:
        yield from ("", table)


def _six(d: Diagnosis) -> Table:
    c = d.calibration
    table = Table(box=None, padding=(0, 1), show_edge=False)
    status = calibrated(c) if c.status is Status.CALIBRATED else c.status.value
    headings = (f"calibration: {status}", "in force", "estimate", "sigma", "seen")
    for heading in headings:
        table.add_column(heading, justify="left" if heading is headings[0] else "right")
    rows = zip(
        SIX_NAMES,
        c.in_force_scale + c.in_force_offset,
        c.scale + c.offset,
        c.scale_sigma + c.offset_sigma,
        seen(c),
        strict=True,
    )
    for name, *numbers, how in rows:
        shown = [fixed(x, 4).replace("−", "-") for x in numbers]
        table.add_row(name, *shown, how)
    return table


def _plain(sentence: str, style: str = "") -> Text:
    """Words of the page for a terminal, which may not know every sign and breaks at any space."""
    for sign, ours in (("−", "-"), ("\u00a0%", "%"), (" %", "%")):
        sentence = sentence.replace(sign, ours)
    return Text(sentence, style=style)
