"""Every number that decides something on the link: its unit, and where it comes from.

Numbers of the protocol itself (lengths, identities, epochs) stand where they are used.

Provenance in brackets: *protocol* (MAVLink's specification), *ArduPilot* (how it behaves), *data*
(rates and sizes of what travels), *cost* (more buys nothing), or *tuned*.
"""

from __future__ import annotations

from typing import Final

# Bytes: transports, codec, endpoints

LINGER_S: Final = 0.02
"""s that a descriptor is left alone after a read while an answer is waited for or a push is under
way: 50 wake-ups per second, and inertial samples come every 20 ms [data]."""
REST_S: Final = 0.3
"""s that it is left alone at all other times.  The link reads with each tick, which comes sooner,
so that one wake-up does for both [cost]."""
SERIAL_LINGER_S: Final = 0.04
"""s that a serial line is left alone at the most: at 921600 baud it brings 3.7 kB in that time, and
the system keeps 4 kB of a terminal before it holds the sender back or loses bytes [data]."""
ASKING_S: Final = 1.0
"""s after a question for which its answer is waited for: the first of all waits [tuned: what one
question of the rates waits]."""
CONNECT_TIMEOUT_S: Final = 5.0
"""s; a TCP peer on the same companion or network answers at once, or not at all [tuned]."""
READ_SIZE: Final = 65536
"""bytes; no datagram is longer [protocol: UDP]."""
BYTES_PER_TURN: Final = 4096
"""bytes that are read before the loop has its turn: what the heaviest stream of one accelerometer
brings from tick to tick is 2.4 kB; bytes made to be slow to parse take some milliseconds [cost]."""
DATAGRAMS_PER_TURN: Final = 1024
"""So many are read in a turn, also of those that are empty or bring an error: 2 to 3 ms, and a
socket is emptied faster than a core can fill it [cost]."""
SOCKET_BYTES: Final = 1 << 20
"""bytes that the system is asked to keep for a datagram socket: some thousand small datagrams, a
second of a vehicle's and 0.05 s of a flood [cost]."""
SENDERS_WAITING: Final = 64
"""Addresses of which something waits to be handed on, without the vehicle's: twice those that are
listened to [cost]."""
WAITING_BYTES: Final = 131072
"""bytes of one of them that wait: two of the longest datagrams, or a second of a flood [cost]."""
FULL_TURN_PAUSE_S: Final = 0.001
"""s between two turns while more waits than one of them reads [cost]."""
SOURCES_MAX: Final = 256
"""Senders whose packets are counted one by one: a vehicle has a dozen components [cost]."""
WRITE_LIMIT: Final = 65536
"""bytes that may wait for a stalled peer; more is dropped, for telemetry ages fast: 11 s of a line
of 57600 baud [tuned]."""
PEER_LIMIT: Final = 8
"""UDP peers that are answered: a router, a few ground stations; bounds what we send [tuned]."""
PEERS_KNOWN: Final = 32
"""UDP addresses that are listened to at a time; beyond that merit decides [cost: 5 kB each]."""
NEWCOMERS_HZ: Final = 100.0
"""1/s; new addresses that are looked at while the table is full: each costs 40 us [cost]."""
PEER_BYTES_S: Final = 100e3
"""bytes/s of one UDP address that is not the vehicle's: ten times a fast link's [cost]."""
VEHICLE_BYTES_S: Final = 2e6
"""bytes/s of the vehicle's address: more than a core can take in [cost]."""
PEER_SILENCE_S: Final = 30.0
"""s; a UDP peer that sent nothing for so long has gone: 30 HEARTBEATs [tuned]."""
DEFAULT_BAUD: Final = 57600
"""baud of a serial endpoint that names none [ArduPilot: SERIAL1_BAUD 57]."""
REORDERING: Final = 16
"""Packets; a sequence number at most this far behind is a late one, further back some were lost
[tuned: the number has 8 bits]."""
NEW_STREAM_LAG_S: Final = 60
"""s that the first signature of a stream may lie behind ours [protocol]."""

# Connections

BACKOFF_BASE_S: Final = 0.5
"""s; ceiling of the first wait before the next try [tuned]."""
BACKOFF_CAP_S: Final = 15.0
"""s; a USB autopilot is back some seconds after a reboot, waiting longer loses flight [data]."""
STABLE_S: Final = 10.0
"""s; a connection that held this long starts the back-off from the beginning [tuned]."""
SILENCE_S: Final = 15.0
"""s; a TCP or serial line without one byte for so long is dead, whatever the system says: 15
HEARTBEATs [data]."""

# The autopilot

TICK_S: Final = 0.1
"""s between two polls of the participants while an answer is waited for, a push is under way or one
of them has just said something: below every wait that one of them has [cost]."""
REST_TICK_S: Final = 0.2
"""s between two at all other times.  HEARTBEATs are read with the tick; what they are delayed by
may be a fifth of their interval, or two that contradict each other could not be told from two that
follow each other (CONTRADICTION_S) [data].  Half as many wake-ups [cost]."""
HEARTBEAT_INTERVAL_S: Final = 1.0
"""s between two of our own [protocol]."""
HEARTBEAT_TIMEOUT_S: Final = 5.0
"""s; five HEARTBEATs missed [ArduPilot: its own measure for losing a ground station]."""
FAILOVER_S: Final = 1.5
"""s of silence on the endpoint in use after which another one that hears the autopilot takes over:
one HEARTBEAT missed [data]."""
PROOF_S: Final = 5.0
"""s that somebody who calls himself an autopilot has to show time stamps that advance: its rates
are asked for at once, and an answer takes a second or two on a poor link [tuned]."""
PROOF_STAMPS: Final = 3
"""Time stamps that advance make a stream; a HEARTBEAT alone is easily said [tuned]."""
GIVEN_UP_S: Final = 15.0
"""s of silence after which the vehicle's name is also given to one that has shown no stream: one
that rebooted with its router, or nobody [tuned: what makes a stream's line dead]."""
CLOCK_AGREES_S: Final = 2.0
"""s between the boot clocks of two ways to one vehicle: the longest delay of a link [data]."""
CLAIMS_KNOWN: Final = 32
"""Claims to be an autopilot that are followed at a time [cost]."""
SOURCES_KNOWN: Final = 256
"""Senders (system and component) whose way is remembered [cost]."""
TWIN_S: Final = 10.0
"""s; another service under our own name that is silent for so long has gone: ten HEARTBEATs
[data]."""
DOUBTFUL_S: Final = 10.0
"""s after a contradiction between samples for which it is shown [tuned]."""
EARLY_SOURCES: Final = 8
"""Senders whose parameters are kept until one of them turns out to be the autopilot [tuned]."""
EARLY_PARAMETERS: Final = 3000
"""Parameters kept of each: more than any firmware has [tuned]."""

# Which board answers

BOARD_ASKED_S: Final = 30.0
"""s between two questions to a board that has said which it is: as often as its parameters are read
anew, in a hundred bytes [cost]."""
CLOCKS_APART_S: Final = 9.0
"""s for which another boot clock has to go on beside the one that is followed to be another one's:
three times what a link delays, a reboot and all that was on its way before it included [data]."""
TWO_BOARDS_S: Final = 100.0
"""s after two boards have answered in turn for which both are there: three questions [data]."""
ANSWER_TIMEOUT_S: Final = (1.0, 1.0, 2.0, 4.0, 1.0, 1.0, 2.0, 4.0)
"""s that each try waits before the next one.

Half of them ask with the command of today, half with that of old firmware.  Where a link loses
a third of all frames, question and answer both get through in 0.44 of the tries, so that all
eight fail in one start out of a hundred; where it loses nothing the first is answered [data].  The
longer waits are for a boot that is still busy and for parameters fetched at the same time [tuned].
"""

# The boot clock

LATENESS_FORGOTTEN: Final = 0.5
"""s for each second in which both clocks went on: a clock at two thirds of our pace, as that of a
simulator on a busy machine, is not late.  A slower one says HEARTBEAT too seldom to be written to
anyway (FRESH_S of a push, 1.5 s) [use]."""
NEAR_WRAP_S: Final = 600.0
"""s; a jump back by one wrap is a wrap only this close to it, else a reboot [tuned]."""
UNIX_FROM_US: Final = 10**15
"""us; a ``time_usec`` above this, 31 years of uptime, is Unix time: some autopilots send that
[data]."""
UNIX_STEP_S: Final = 10.0
"""s; Unix time that departs this far from boot time has been set (by GPS, say): a crystal drifts by
a few seconds a day [data]."""

# Message rates

LADDER_MS: Final = (1, 2, 4, 5, 8, 10, 20, 25, 40, 50, 100, 200, 500, 1000)
"""ms; intervals that are tried, whole ones and few [ArduPilot: ten buckets of equal interval]."""
ACK_TIMEOUT_S: Final = 1.0
"""s before a question is asked again [tuned]."""
ASKS: Final = 4
"""Tries of one question before the autopilot counts as mute on it: where a third of all frames is
lost, they all fail in one case of ten [data]."""
RECHECK_S: Final = 60.0
"""s; a message found to be unsupported is asked for once more: an acknowledgement that came late or
twice can have been about another message [tuned]."""
MUTE_MESSAGES: Final = 2
"""So many mute questions, while nothing was ever answered, mean firmware without the command
[tuned]."""
RATE_WINDOW_S: Final = 4.0
"""s over which a rate is measured: four messages of the slowest [data]."""
RATE_SHORTFALL: Final = 0.5
"""Share of what was granted; below it the rate is asked for again [tuned]."""
RATE_FULL: Final = 0.8
"""Share of what was granted; below it a line is full: one that has room delivers nine tenths and
more [data]."""
SELDOM_MS: Final = 250
"""ms between two of each stream while parameters are written: all of them together are 1 kB/s then,
half of what 19200 baud carry [data]."""
BEATS_MS: Final = 200
"""ms between two HEARTBEATs while parameters are written to a vehicle that stands: so late it is
heard that it has armed; 0.1 kB/s [cost]."""
BEATS_ASKED: Final = 2
"""Times that this is asked for, and taken back: one is lost [tuned]."""
AGAIN_S: Final = (1.0, 5.0, 10.0, 20.0, 40.0, 60.0)
"""s before asking again [ArduPilot: slows streams itself while parameters are fetched]."""

# Parameters of the autopilot

READS_IN_FLIGHT: Final = 8
"""Reads that wait for an answer at a time: leaves room for a ground station that reads, too
[ArduPilot: queues 20 requests and 5 replies for *all* links together]."""
ATTEMPTS: Final = 5
"""Tries of one read or write: where a third of all frames is lost, they all fail in one case of
eighteen [data]."""
FIRST_TIMEOUT_S: Final = 0.7
"""s before the second try [tuned]."""
REPEAT_PAUSE_S: Final = 0.25
"""s between two writes of one parameter, whatever answers come: a good link answers in a tenth
[tuned]."""
TIMEOUT_GROWTH: Final = 1.5
"""Ratio of one wait to that before it [tuned]."""
PARAMETERS_MAX: Final = 3000
"""Values that are kept: more than any firmware has.  What was asked for is kept besides [cost]."""
LONGEST_TIMEOUT_S: Final = 3.0
"""s; no wait between two tries is longer [tuned]."""

# Our own parameters

LIST_HZ: Final = 50.0
"""1/s; PARAM_VALUE is 37 bytes on the wire, so that a list takes 1.9 kB/s for its second [data]."""
ANNOUNCE_HZ: Final = 5.0
"""1/s; changes take 0.2 kB/s [data]."""
ASKED_HZ: Final = 20.0
"""1/s; requests of ground stations that are answered at once, and so many in a burst: 0.7 kB/s.  A
station waits for each answer before it asks again [data]."""
BURST_S: Final = 0.2
"""s; sending that was not possible for longer than this is not made up for [tuned]."""

# The recording

FLUSH_INTERVAL_S: Final = 1.0
"""s; so much of a recording a power cut costs [tuned]."""
PENDING_LIMIT: Final = 8 << 20
"""bytes held for a disk that does not keep up, about ten minutes; more is dropped [data]."""
CLOSE_TIMEOUT_S: Final = 3.0
"""s that the disk gets for the last bytes, inside what the service manager gives us [tuned]."""
