"""The demonstration on a terminal: its lines and its panel do not write over each other."""

from __future__ import annotations

import asyncio
import io
import re
import signal
from types import SimpleNamespace

import pytest
from rich.console import Console

from onboard.cli.demo import _stay
from onboard.cli.demo_show import Show
from tests.gcs.vehicles_state import accelerometer, seen

WIDTH, HEIGHT = 80, 24


def screen(written: str) -> list[str]:
    """What stands on a terminal after these characters: it knows the few moves that rich makes."""
    lines, row, column = [""], 0, 0
    for move, text in re.findall(r"(\x1b\[[0-9;?]*[A-Za-z]|[\r\n])|([^\x1b\r\n]+)", written):
        if text:
            lines[row] = f"{lines[row][:column]:<{column}}{text}{lines[row][column + len(text) :]}"
            column += len(text)
        elif move == "\n":
            row, column = row + 1, 0
            lines += [""] * (row + 1 - len(lines))
        elif move == "\r":
            column = 0
        elif move.endswith("A"):
            row = max(0, row - int(move[2:-1]))
        elif move.endswith("K"):
            lines[row] = ""
    return [line.rstrip() for line in lines]


def terminal() -> Console:
    return Console(
        file=io.StringIO(), force_terminal=True, width=WIDTH, height=HEIGHT, highlight=False
    )


def watched(show: Show) -> None:
    imus = [accelerometer(1), accelerometer(2)]
    service = SimpleNamespace(snapshot=lambda: seen(imus=imus))
    show.watch(service, SimpleNamespace(armed=True, time=140.0))


def test_every_stage_stays_readable_above_one_panel():
    console = terminal()
    with Show(console) as show:
        show.stage("the first stage")
        watched(show)
        for n in range(20):
            show._live.refresh()
            if n % 5 == 0:
                show.stage(f"stage {n} of many")
        lines = screen(console.file.getvalue())
    stages = [line.strip() for line in lines if "stage" in line]
    assert [s.split("s  ")[-1] for s in stages] == [
        "the first stage",
        *(f"stage {n} of many" for n in (0, 5, 10, 15)),
    ]
    assert sum("armed, " in line for line in lines) == 1
    assert sum(line.startswith("IMU 1: ") for line in lines) == 1
    assert max(map(len, lines)) <= WIDTH


def test_the_panel_goes_and_the_lines_stay():
    console = terminal()
    with Show(console) as show:
        watched(show)
        show.stage("landed")
        show._live.refresh()
        show.end()
        console.print("the table")
    lines = [line for line in screen(console.file.getvalue()) if line]
    assert [line.split()[-1] for line in lines] == ["landed", "table"]


def test_where_nobody_watches_there_are_lines_only():
    console = Console(file=io.StringIO(), width=WIDTH)
    with Show(console) as show:
        watched(show)
        show.stage("landed")
    assert console.file.getvalue() == "   140 s  landed\n"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_the_page_stays_until_somebody_ends_it(number):
    console = Console(file=io.StringIO(), width=WIDTH)
    staying = asyncio.create_task(_stay(console, "http://127.0.0.1:8191"))
    await asyncio.sleep(0.05)
    assert not staying.done()
    assert "stays at http://127.0.0.1:8191; Ctrl-C ends it" in console.file.getvalue()
    signal.raise_signal(number)
    async with asyncio.timeout(10.0):
        await staying
