"""The writer: carries one transaction out, between the link, the journal and a clock.

The transaction is sans-IO (:mod:`onboard.push.transaction`).  Journal entries are written where it
asks for them, in the loop: the order of writes is what the guarantee rests on, and a push is six
writes after a flight.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from onboard.daemon.pushing.ledger import Ledger
from onboard.mavlink.dialect import COMPONENT, Message, mavlink
from onboard.mavlink.parameter_messages import SendAction, parameter_event, parameter_message
from onboard.push.signals import Finished, Outcome, Record, TransactionEvent, TransactionOutput
from onboard.push.transaction import PushTransaction


class Writer:
    """One transaction at a time; whatever moves it returns how it ended, if it has.

    Args:
        ledger: where its entries go.
    """

    names = ("PARAM_VALUE", "PARAM_ERROR", "STATUSTEXT")

    def __init__(self, ledger: Ledger) -> None:
        self.target: tuple[int, int] | None = None
        self.transaction: PushTransaction | None = None
        self.idle = asyncio.Event()
        self.idle.set()
        self._ledger = ledger
        self._codec = mavlink.MAVLink(None)
        self._outbox: list[Message] = []

    @property
    def busy(self) -> bool:
        """Whether a transaction is under way."""
        return self.transaction is not None

    def begin(self, transaction: PushTransaction, now: float) -> Outcome | None:
        """Carry out this one from now on."""
        self.transaction = transaction
        self.idle.clear()
        return self._act(transaction.start(now), now)

    def tell(self, event: TransactionEvent, now: float) -> Outcome | None:
        """What happens while it is under way."""
        if self.transaction is None:
            return None
        return self._act(self.transaction.feed(event, now), now)

    def hear(self, message: Message, now: float) -> Outcome | None:
        """Take the autopilot's word on a parameter."""
        if self.transaction is None or self.target is None:
            return None
        system, component = self.target
        event = parameter_event(
            message,
            system=system,
            component=component,
            own_system=system,
            own_component=COMPONENT,
        )
        return None if event is None else self.tell(event, now)

    def tick(self, now: float) -> Outcome | None:
        """Let time pass."""
        if self.transaction is None:
            return None
        deadline = self.transaction.next_deadline()
        if deadline is None or deadline > now:
            return None
        return self._act(self.transaction.tick(now), now)

    def take_outbox(self) -> Sequence[Message]:
        """The messages that are to be sent."""
        messages, self._outbox = self._outbox, []
        return messages

    def _act(self, outputs: Sequence[TransactionOutput], now: float) -> Outcome | None:
        """Carry out the outputs in their order, what a journal entry leads to included."""
        ended: Outcome | None = None
        for output in outputs:
            match output:
                case Record(entry):
                    ended = self.tell(self._ledger.append(entry), now) or ended
                case Finished(outcome):
                    self.transaction = None
                    self.idle.set()
                    ended = outcome
                case _ if isinstance(output, SendAction):
                    system, component = self.target or (0, 0)
                    self._outbox.append(
                        parameter_message(output, self._codec, system=system, component=component)
                    )
        return ended
