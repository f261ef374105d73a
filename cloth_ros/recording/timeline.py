"""
The ticks of a recorded cloth in their order, each with the state that was published after it.

Messages of different topics may be recorded in another order than they were published in.  So a
record is held until its state has come, up to a limit; and what a recorder has lost is found by
the numbers of the ticks, which then begin again at a keyframe.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..live.keyframe import Keyframe
from ..live.tick_record import RESTORED, Change, TickRecord
from .bag import Message
from .recorded_cloth import LiveEstimate, Particles, RecordedCloth

# Records that are held for a state that may still come; and for a keyframe, some minutes of ticks.
_HELD = 100
_HELD_FOR_KEYFRAME = 20_000


class Start(NamedTuple):
    """The cloth is in the state of a keyframe: at first, after a gap, and where one was loaded."""

    keyframe: Keyframe


class Step(NamedTuple):
    """A tick, and the values of `Particles` after it; None: that was not recorded."""

    record: TickRecord
    recorded: NDArray[np.float32] | None


class Checkpoint(NamedTuple):
    """The cloth must now be in the state of a keyframe."""

    keyframe: Keyframe


class Gap(NamedTuple):
    """
    Ticks that cannot be repeated.

    Attributes
    ----------
    after, until
        Numbers of the ticks before and behind it.
    stamp
        Time of the state behind it, ns; None: it lasts until the end of the recording.

    """

    after: int
    until: int
    stamp: int | None


Entry = Start | Step | Checkpoint | Gap | LiveEstimate | Message


class _Timeline:
    def __init__(self, recorded: RecordedCloth) -> None:
        self._recorded = recorded
        self._records: deque[TickRecord] = deque()
        self._states: OrderedDict[int, NDArray[np.float32]] = OrderedDict()
        # Those that are ahead of the records that are held.
        self._keyframes: deque[Keyframe] = deque(maxlen=_HELD)
        self._at: TickRecord | Keyframe | None = None  # the tick that was repeated last
        self._gap: TickRecord | Keyframe | None = None  # the last tick before the present gap
        self._has_states = recorded.has_particles
        self._last: TickRecord | None = None  # that was received last

    def entries(self) -> Iterator[Entry]:
        for event in self._recorded.events():
            if isinstance(event, TickRecord):
                if self._last is not None and event.tick <= self._last.tick:
                    yield from self._end_run(event)
                self._records.append(event)
                self._last = event
            elif isinstance(event, Particles):
                # Not again, as it is published while the cloth is paused.
                if self._at is None or event.stamp != self._at.stamp:
                    self._states.setdefault(event.stamp, event.values)
                if len(self._states) > 2 * _HELD:
                    self._states.popitem(last=False)
            elif isinstance(event, Keyframe):
                yield from self._take_keyframe(event)
            elif isinstance(event, LiveEstimate):
                yield event._replace(tick=0 if self._last is None else self._last.tick)
            else:
                yield event
            yield from self._ready(final=False)
        yield from self._ready(final=True)
        if self._at is None and self._records and self._gap is not None:
            last = self._records[-1]
            yield Gap(self._gap.tick, last.tick + 1, None)

    def _end_run(self, first: TickRecord) -> Iterator[Entry]:
        """End the ticks of a node that was started again, and begin those of the new one."""
        yield from self._ready(final=True)
        self._gap, self._at = self._at or self._gap, None
        self._records.clear()
        self._states.clear()
        keyframe = self._take_keyframe_from(partial(_same, first))
        self._keyframes.clear()
        if keyframe is not None:
            yield from self._start(keyframe)

    def _take_keyframe(self, keyframe: Keyframe) -> Iterator[Entry]:
        if self._at is None:
            # Not one from before the gap that has come late.
            if not self._records or keyframe.tick >= self._records[0].tick - 1:
                yield from self._start(keyframe)
        elif _same(self._at, keyframe):
            yield Checkpoint(keyframe)
        else:
            self._keyframes.append(keyframe)

    def _start(self, keyframe: Keyframe) -> Iterator[Entry]:
        while self._records and self._records[0].tick <= keyframe.tick:
            self._records.popleft()
        if self._gap is not None:
            yield Gap(self._gap.tick, keyframe.tick, keyframe.stamp)
        self._at, self._gap = keyframe, None
        yield Start(keyframe)

    def _take_keyframe_from(self, fits: Callable[[Keyframe], bool]) -> Keyframe | None:
        """Take the first keyframe that fits, and discard those before it."""
        found = next(filter(fits, self._keyframes), None)
        while found is not None and self._keyframes.popleft() is not found:
            pass
        return found

    def _ready(self, *, final: bool) -> Iterator[Entry]:
        while self._records:
            if self._at is None:
                if len(self._records) > _HELD_FOR_KEYFRAME:
                    self._records.popleft()
                return
            record = self._records[0]
            if record.tick <= self._at.tick and record.stamp <= self._at.stamp:
                self._records.popleft()  # of before the keyframe, and recorded behind it
                continue
            if record.tick != self._at.tick + 1:
                yield from self._end_at_gap()
                continue
            late = final or len(self._records) > _HELD
            changed = record.stamp == self._at.stamp  # while the cloth was paused
            if self._has_states and record.stamp not in self._states and not (late or changed):
                return
            restored = any(change.kind == RESTORED for change in record.changes)
            if restored and not any(_same(record, keyframe) for keyframe in self._keyframes):
                if not late:
                    return
                yield from self._end_at_gap()
                continue
            self._records.popleft()
            keyframe = self._take_keyframe_from(partial(_same, record))
            if restored and keyframe:
                yield Start(keyframe)
                record = _without_motion(record)
            self._at = record
            yield Step(record, self._take_state(record.stamp))
            if keyframe and not restored:
                yield Checkpoint(keyframe)

    def _take_state(self, stamp: int) -> NDArray[np.float32] | None:
        """Take the state of a time, and discard those before it."""
        if stamp not in self._states:
            return None
        while True:
            found, values = self._states.popitem(last=False)
            if found == stamp:
                return values

    def _end_at_gap(self) -> Iterator[Entry]:
        """Go on from the next keyframe, if it has come already."""
        self._gap, self._at = self._at, None
        first = self._records[0]

        def fits(keyframe: Keyframe) -> bool:
            before = keyframe.tick == first.tick - 1 and keyframe.stamp < first.stamp
            return before or any(_same(each, keyframe) for each in self._records)

        keyframe = self._take_keyframe_from(fits)
        if keyframe:
            yield from self._start(keyframe)


def _same(first: TickRecord | Keyframe, second: TickRecord | Keyframe) -> bool:
    return first.tick == second.tick and first.stamp == second.stamp


def _without_motion(record: TickRecord) -> TickRecord:
    """Return the record of a tick whose keyframe is known: there is nothing left to be done."""
    return TickRecord(record.tick, record.stamp, record.clock, record.time, (Change(RESTORED),))


def timeline(recorded: RecordedCloth) -> Iterator[Entry]:
    """Yield the ticks in their order, and what else was recorded as it comes."""
    return _Timeline(recorded).entries()
