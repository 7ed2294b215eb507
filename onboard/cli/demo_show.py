"""What the demonstration shows while it runs: stages as lines, progress below them.

One console owns the terminal: a panel that another one draws would be written over by the lines.
"""

from __future__ import annotations

import threading
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from onboard.cli.panel import STYLES
from onboard.core.estimate.result import SIX_NAMES

if TYPE_CHECKING:
    from onboard.daemon.process.service import Service
    from onboard.daemon.view.snapshot import ImuView
    from sitl.station import Station

REFRESH_HZ = 4.0


class Show:
    """Lines for the stages; on a terminal also a panel that lives, below them.

    Args:
        console: where all of it goes.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Live | None = None
        self._service: Service | None = None
        self._station: Station | None = None
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live = Live(
                get_renderable=self._panel,
                console=self._console,
                refresh_per_second=REFRESH_HZ,
                transient=True,
            )
            self._live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.end()

    def end(self) -> None:
        """The panel goes; the lines stay."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def watch(self, service: Service, station: Station) -> None:
        """Shows these from now on."""
        with self._lock:
            self._service, self._station = service, station

    def stage(self, sentence: str) -> None:
        """Says what comes next."""
        clock = "" if self._station is None else f"{self._station.time:6.0f} s  "
        self._console.print(Text(f"{clock:>10}{sentence}"))

    def _panel(self) -> RenderableType:
        with self._lock:
            service, station = self._service, self._station
        if service is None or station is None:
            return Text()
        snapshot = service.snapshot()
        state = "armed" if station.armed else "disarmed"
        trust = "GPS trusted" if snapshot.trust.open else "GPS not trusted"
        head = Text(f"{station.time:8.0f} s  {state}, {trust}", style="bold")
        return Group(Text(), head, *(_imu(view) for view in snapshot.imus))


def _imu(view: ImuView) -> RenderableType:
    """Its state, estimates, and sigmas under them."""
    head = Text(f"IMU {view.imu}: ", no_wrap=True, overflow="ellipsis")
    head.append(view.state.title, style=STYLES.get(view.state.severity, "default"))
    head.append(f", {view.coverage.percent:.0f} % covered")
    table = Table(box=None, padding=(0, 1), show_edge=False)
    table.add_column("", width=8)
    for name in SIX_NAMES:
        table.add_column(name, justify="right", width=9)
    c = view.calibration
    numbers = c.scale + c.offset
    sigmas = c.scale_sigma + c.offset_sigma
    table.add_row("estimate", *(_number(x, "{:.4f}") for x in numbers))
    table.add_row("sigma", *(_number(x, "{:.4f}") for x in sigmas))
    return Group(head, table)


def _number(x: float | None, pattern: str) -> str:
    return "-" if x is None else pattern.format(x)
