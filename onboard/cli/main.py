"""``onboard``: the group of verbs, and the one place where failures become exit statuses.

Verbs are imported when they are used, so that ``onboard --help`` and the daemon's helpers start
at once.
"""

from __future__ import annotations

import gc
import importlib
import os
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import click

from onboard import __version__
from onboard.cli.simulator import make_importable
from onboard.errors import OnboardError
from onboard.printable import printable
from onboard.threads import in_one_thread, leave

DONE, USAGE, INTERRUPTED = 0, 2, 130
COMPLETION = "_ONBOARD_COMPLETE"
"""Set by a shell that asks click for completions."""


@dataclass(frozen=True, slots=True)
class Verb:
    """Where a verb lives, and its line in the help."""

    module: str
    attribute: str
    summary: str
    simulates: bool = False


VERBS: dict[str, Verb] = {
    "demo": Verb(
        "onboard.cli.demo",
        "demo",
        "Fly a simulated autopilot and calibrate it, to see it work.",
        simulates=True,
    ),
    "run": Verb("onboard.cli.run", "run", "The service: calibrate an autopilot while it flies."),
    "status": Verb("onboard.cli.status", "status", "What the running service has learned."),
    "approve": Verb("onboard.cli.status", "approve", "Let the service write what it proposes."),
    "reject": Verb("onboard.cli.status", "reject", "Decline what the service proposes."),
    "rollback": Verb("onboard.cli.status", "rollback", "Put the previous parameters back."),
    "reset": Verb("onboard.cli.status", "reset", "Forget what was learned and start again."),
    "replay": Verb("onboard.cli.replay", "replay", "Calibrate from recordings: .BIN, .tlog, .ulg."),
    "explain": Verb(
        "onboard.cli.explain", "explain", "Find the physics that a recording has left out."
    ),
    "match": Verb(
        "onboard.cli.match", "match", "Find what a vehicle has that its simulation lacks."
    ),
    "fleet": Verb("onboard.cli.fleet", "fleet", "Calibrate from every recording in folders."),
    "service": Verb("onboard.cli.service", "service", "The systemd unit: show it, install it."),
    "sim": Verb(
        "onboard.cli.sim",
        "sim",
        "The simulated autopilot alone, for any ground station.",
        simulates=True,
    ),
}


class LazyGroup(click.Group):
    """A group that knows its verbs by name and imports the one that is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Verbs in the order of the table."""
        del ctx
        return [name for name, verb in VERBS.items() if find_spec(verb.module) is not None]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the verb; None if there is none of that name."""
        if cmd_name not in self.list_commands(ctx):
            return None
        verb = VERBS[cmd_name]
        if verb.simulates:
            make_importable()
        command = getattr(importlib.import_module(verb.module), verb.attribute)
        if not isinstance(command, click.Command):
            raise TypeError(f"{verb.module}.{verb.attribute} is not a command")
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the verbs without importing them."""
        verbs = [(name, VERBS[name].summary) for name in self.list_commands(ctx)]
        if verbs:
            with formatter.section("Commands"):
                formatter.write_dl(verbs)


EPILOG = """\
\b
Try it:           onboard demo
From a recording: onboard replay flight.BIN
On the vehicle:   onboard run --config /etc/onboard/onboard.toml

Examples of each command: onboard COMMAND --help

\b
Completion of commands and options in bash (zsh and fish alike):
  eval "$(_ONBOARD_COMPLETE=bash_source onboard)"

Exit status: 0 done, whatever the verdict; 2 wrong usage, configuration or input; 3 the link or
the autopilot failed; 130 interrupted.
"""


@click.group(
    cls=LazyGroup,
    epilog=EPILOG,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, prog_name="onboard")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Calibrate the accelerometers of a MAVLink autopilot in flight.

    While GPS is trusted, the measured accelerations, turned to the earth's frame and integrated,
    must give the GPS velocity.  From that follow scale and offset of each axis of every
    accelerometer, with an honest uncertainty: ArduPilot's INS_ACCSCAL_* and INS_ACCOFFS_*.
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help(), err=True)
        ctx.exit(USAGE)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit status; a failure is one line on standard error."""
    if COMPLETION in os.environ:
        cli.main(prog_name="onboard")
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        # Not cli.main(): that turns a closed pipe into status 1 before we see it.
        with cli.make_context("onboard", given) as context:
            cli.invoke(context)
        sys.stdout.flush()
    except click.exceptions.Exit as request:
        return request.exit_code
    except click.UsageError as error:
        where = error.ctx.command_path if error.ctx is not None else "onboard"
        return _fail(f"{error.format_message().rstrip('.')} (see {where} --help)", USAGE)
    except click.ClickException as error:
        return _fail(error.format_message(), USAGE)
    except OnboardError as error:
        return _fail(str(error), error.exit_status)
    except (click.Abort, KeyboardInterrupt):
        return _fail("interrupted", INTERRUPTED)
    except BrokenPipeError:
        _forget_output()
    return DONE


def _fail(message: str, status: int) -> int:
    try:
        click.echo(f"onboard: {printable(' '.join(message.split()))}", err=True)
    except BrokenPipeError:
        _forget_output()
    return status


def _forget_output() -> None:
    """Whoever read us is gone (``| head``): nothing more to say, and no complaint at exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def main() -> None:
    """Entry point of the ``onboard`` command."""
    in_one_thread(os.environ)
    # Numbers that no vehicle has are told of in a sentence; numpy's own are for programmers.
    warnings.filterwarnings("ignore", category=RuntimeWarning)
    status = run()
    gc.freeze()  # what ends with the process need not be looked through: 0.2 s after a flight
    leave(status)
