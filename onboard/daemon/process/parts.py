"""The parts of one service, made from its configuration, each before those that need it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

from onboard.daemon.learning.diagnoses import Diagnoses
from onboard.daemon.learning.handover import Handover
from onboard.daemon.learning.learner import Learner
from onboard.daemon.learning.store import Store
from onboard.daemon.process.calendar import Calendar
from onboard.daemon.process.company import Company
from onboard.daemon.process.condition import Observed
from onboard.daemon.process.hindrance import Hindrance
from onboard.daemon.process.signing_file import SigningFile
from onboard.daemon.process.situation import Situation
from onboard.daemon.process.vigilance import Vigilance
from onboard.daemon.pushing.ledger import Ledger
from onboard.daemon.pushing.parameters import NEEDED, ParameterWatch
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.pushing.pusher import Pusher
from onboard.daemon.pushing.witness import Witness
from onboard.daemon.setup import settings
from onboard.daemon.setup.configuration import Configuration
from onboard.daemon.view.notices import Notices
from onboard.daemon.view.traffic import Traffic
from onboard.errors import DiskError
from onboard.mavlink.autopilot import Participant
from onboard.mavlink.board import Board
from onboard.mavlink.link import Link
from onboard.mavlink.recorder import Recorder
from onboard.mavlink.signing import Signing
from onboard.mavlink.streams import Streams
from onboard.push.journal import Journal


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """Everything that a service is made of but its outlets, which look at the whole of it."""

    calendar: Calendar
    notices: Notices
    recorder: Recorder | None
    signing: Signing | None
    signing_file: SigningFile
    link: Link
    board: Board
    company: Company
    streams: Streams
    parameters: ParameterWatch
    observed: Observed
    traffic: Traffic
    journal: Journal
    ledger: Ledger
    witness: Witness
    proposals: Proposals
    pusher: Pusher
    diagnoses: Diagnoses
    handover: Handover
    vigilance: Vigilance

    @classmethod
    def of(
        cls,
        configuration: Configuration,
        *,
        clock: Callable[[], float],
        wall_clock: Callable[[], float],
    ) -> Self:
        """Make them.

        Args:
            configuration: what.
            clock: monotonic time, s.
            wall_clock: Unix time, s.

        Raises:
            ConfigurationError: an endpoint, key or directory that cannot be used.
            StateError: the journal is locked or damaged.
        """
        directory = configuration.state.path()
        calendar = Calendar(wall_clock, clock)
        notices, witness, board = Notices(calendar), Witness(), Board()
        parameters, observed, traffic = ParameterWatch(), Observed(), Traffic()
        signing_file = SigningFile(directory / "signing.json")
        signing = settings.signing(configuration.link, wall_clock, signing_file.load())
        recorder = _recorder(configuration, notices, wall_clock)
        link = _link(configuration, signing, recorder, clock, wall_clock)
        ledger = Ledger(journal := Journal(directory / "journal.jsonl"), calendar)
        proposals = _proposals(configuration, ledger)
        pusher = Pusher(ledger, proposals, witness, notices)
        company = Company(link, board, parameters)
        situation = Situation(link, board, parameters, witness, proposals)
        handover = _handover(configuration, notices, situation, clock, calendar)
        streams = Streams(settings.stream_requests(configuration.link.rates))
        hindrance = Hindrance(link, parameters, streams, traffic, has_key=signing is not None)
        _introduce(link, streams, pusher, handover)
        return cls(
            calendar=calendar,
            notices=notices,
            recorder=recorder,
            signing=signing,
            signing_file=signing_file,
            link=link,
            board=board,
            company=company,
            streams=streams,
            parameters=parameters,
            observed=observed,
            traffic=traffic,
            journal=journal,
            ledger=ledger,
            witness=witness,
            proposals=proposals,
            pusher=pusher,
            diagnoses=Diagnoses(ledger.append, notices),
            handover=handover,
            vigilance=Vigilance(
                link, company, observed, signing, handover, hindrance, ledger, notices
            ),
        )

    def keep_signing(self, margin_s: float = 0.0) -> None:
        """Put the signing's time stamps on disk; ``margin_s``: how long they will have to do."""
        if self.signing is not None:
            self.signing_file.save(self.signing.kept(margin_s))

    @property
    def participants(self) -> tuple[Participant, ...]:
        """Those that speak with the autopilot."""
        return self.streams, self.board, self.parameters, self.pusher


def _introduce(link: Link, streams: Streams, pusher: Pusher, handover: Handover) -> None:
    """Let each know what it must of those that were made after it."""
    streams.writing = lambda: pusher.writes_on_the_ground
    pusher.late = lambda: link.boot_clock.lateness.seconds
    link.presence.held = lambda: pusher.busy
    link.presence.committed = lambda: pusher.has_written or handover.has_learned


def _link(
    configuration: Configuration,
    signing: Signing | None,
    recorder: Recorder | None,
    clock: Callable[[], float],
    wall_clock: Callable[[], float],
) -> Link:
    return Link(
        settings.endpoints(configuration.link),
        system=configuration.link.system_id or None,
        component=configuration.link.component_id or None,
        signing=signing,
        recorder=recorder,
        clock=clock,
        wall_clock=wall_clock,
    )


def _proposals(configuration: Configuration, ledger: Ledger) -> Proposals:
    push = configuration.push
    return Proposals(
        settings.policy_settings(push), approval=push.approval, imus=push.imus, refusals=ledger
    )


def _recorder(
    configuration: Configuration, notices: Notices, wall_clock: Callable[[], float]
) -> Recorder | None:
    directory = configuration.state.path()
    try:
        recorder = settings.recorder(configuration.recording, directory, wall_clock)
    except DiskError as error:  # no reason to leave the vehicle without a calibration
        notices.post("recording_stopped", f"nothing is recorded: {error}", warning=True)
        return None
    if recorder is not None:
        recorder.tell = lambda text: notices.post("recording_stopped", text, warning=True)
    return recorder


def _handover(
    configuration: Configuration,
    notices: Notices,
    there: Situation,
    clock: Callable[[], float],
    wall_clock: Callable[[], float],
) -> Handover:
    store = Store(configuration.state.path())
    estimator = settings.estimator_settings(configuration.estimator)

    def learner() -> Learner:
        return Learner(store, estimator, clock=clock, wall_clock=wall_clock)

    return Handover(
        learner(),
        notices,
        there=there,
        clock=clock,
        wall_clock=wall_clock,
        save_every_s=configuration.estimator.save_every_s,
        needed=NEEDED,
        successor=learner,
    )
