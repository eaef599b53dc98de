"""Many runs of a system with edges as arrays: all flow, all jump, until each has ended.

It is what a hybrid run and its instant do, for all runs of a batch at once, as far as no gap has to be searched for and
nothing rare happens: what chatters, what a jump leads beyond a limit and what its method has lost is left to a run by
itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from surfacechem.model.system import START, System
from surfacechem.solve.contract import Array, Index, Mask, Problem, Status
from surfacechem.solve.equilibria import drift_of
from surfacechem.solve.instant import ALOFT, AT_ONCE, FITTED, REACHED, velocity_scales
from surfacechem.solve.jumps import Jumper, booked
from surfacechem.solve.radau.solver import consistent, solve_arrays
from surfacechem.solve.radau.stepper import END, EVENTS, FIRST_COUNTER, OUTPUTS, RECORDS, STOP
from surfacechem.tolerances import BRIEF, CROSSED, DIGITS, MICROMETRE, PICOMETRE

ROOM = 64, 4, 0
"""Steps and events of an arc for which there is room at first: what needs more is solved once more with as much."""

WRITTEN = "counts", "ends", "outputs", "events", "records"
"""What the stepper writes of runs."""

NONE, UNKNOWN = -1, -2
"""Instead of the edge that is due: there is none; what has happened before tells."""


@dataclass
class Course:
    """Whole runs, in columns as the stepper writes those of an arc; of edges the events are those carried out."""

    told: Mask
    """Which of the runs are told to their ends."""
    counts: Index
    ends: Array
    outputs: Array
    events: Array
    records: Array
    segments: Array
    """Starts of the arcs of each run, infinite beyond its last one, shape (runs, arcs + 1)."""
    table: Array
    """Parameters of each arc, shape (runs, arcs, parameters)."""


@dataclass
class _Runs:
    """Where runs are now."""

    inputs: Array
    """Time, states, rates and parameters: arguments of compiled functions, shape (runs, inputs)."""
    table: Array
    """Parameters of each segment, shape (runs, segments, parameters)."""
    breaks: Array
    """Starts of the segments and the end of the last one, shape (runs, segments + 1)."""
    segment: Index
    peaks: Array
    """Largest states seen, shape (runs, states)."""
    exchanged: Array
    """Largest ledger seen, and the one of now, shape (runs, accounts)."""
    booked: Array
    counts: Index
    ends: Array
    outputs: Array
    told: Mask
    going: Mask
    returning: Array
    """Time of the last rebound, and how long it takes to return, shape (runs, 2)."""
    jumped: Array
    """Times of the last jumps, the latest last, shape (runs, jumps)."""
    arcs: list[tuple[Index, Array]] = field(default_factory=list)
    """Of all arcs that begin together the runs, and the inputs at their starts."""
    events: list[tuple[Index, Array]] = field(default_factory=list)
    records: list[tuple[Index, Array]] = field(default_factory=list)

    @property
    def end(self) -> Array:
        """End of the segment that each run is in."""
        return self.breaks[np.arange(len(self.segment)), self.segment + 1]

    def leave(self, own: Index) -> None:
        """Leave these to runs by themselves."""
        self.told[own] = self.going[own] = False


class Stretches:
    """Runs that share with a problem all but their states, parameters and times; no gap of theirs is quasi-static."""

    def __init__(self, system: System, jumper: Jumper, problem: Problem) -> None:
        self.system, self.jumper, self.program, self.keeps_steps = system, jumper, problem.program, problem.record_steps
        self.problem = replace(problem, record_steps=True, picture=0.0)
        self.n, self.accounts = self.program.n, self.program.n_ledger
        self.first = self.program.n_margins - len(system.edges)
        """Index of the first edge among the guards; limits come before."""
        self.terminal = np.array([kind.terminal for kind in problem.margins[: self.first]], dtype=bool)
        self.strict = np.array([kind.strict for kind in problem.margins[self.first :]], dtype=bool)
        limits = system.moving_margins[: self.first]
        self.slack = np.array([0.0 if margin.domain else CROSSED for margin in limits])
        self.returns = [self.first + j for j, edge in enumerate(system.edges) if edge.returns is not None]
        self.given = 1 + 2 * self.n
        """Column of the first parameter among the inputs."""
        self.start = self.given + next(j for j, p in enumerate(system.parameters) if p.path == START)
        self.origins = [self.given + j for j in system.origins]

    def run(self, y0: Array, table: Array, segments: Array, times: Array, spacing: Array) -> Course:
        """Runs from their states at time zero through their segments, whose parameters are ``table``.

        ``segments`` and output ``times`` have a row for each run, or one for all; ``spacing`` is that of looks at the
        equations, shape (runs,).
        """
        count, outputs = len(y0), times.shape[1]
        runs = _Runs(
            inputs=np.concatenate([np.zeros((count, 1)), y0, np.zeros_like(y0), table[:, 0]], axis=1),
            table=table,
            breaks=np.broadcast_to(segments, (count, segments.shape[1])),
            segment=np.zeros(count, np.int64),
            peaks=np.repeat(velocity_scales(self.system)[None], count, axis=0),
            exchanged=np.zeros((count, self.accounts)),
            booked=np.zeros((count, self.accounts)),
            counts=np.zeros((count, STOP), np.int64),
            ends=np.zeros((count, self.given + self.accounts + self.program.n_margins)),
            outputs=np.empty((count, outputs, self.n + self.accounts)),
            told=np.ones(count, dtype=bool),
            going=np.ones(count, dtype=bool),
            returning=np.zeros((count, 2)),
            jumped=np.full((count, AT_ONCE), -np.inf),
        )
        times = np.broadcast_to(times, (count, outputs))
        self._resolve(runs)
        while runs.going.any():
            self._flow(runs, times, spacing)
            self._resolve(runs)
        return self._course(runs)

    # -- what is due --------------------------------------------------------------------------------------------------

    def _sizes(self, inputs: Array, peaks: Array) -> Array:
        """Magnitudes of the guards at the peaks of the states."""
        largest = np.maximum(peaks, np.abs(inputs[:, 1 : 1 + self.n]))
        found = self.jumper.magnitudes(np.concatenate([inputs, largest], axis=1))
        return np.where(np.isfinite(found), found, 0.0)

    def _consistent(self, inputs: Array) -> Array:
        """Inputs with the rates and algebraic variables that belong to them."""
        y, parameters = inputs[:, 1 : 1 + self.n], inputs[:, self.given :]
        found = consistent(self.program, inputs[:, 0], y, np.zeros_like(y), parameters)
        return np.concatenate([inputs[:, :1], found.y, found.ydot, parameters], axis=1)

    def _resolve(self, runs: _Runs) -> None:
        """Carry out all edges that are due at the present of the runs that go on."""
        own, limits = np.flatnonzero(runs.going), slice(0, self.first)
        while len(own):
            inputs, t = runs.inputs[own], runs.inputs[own, 0]
            sizes, playing = self._sizes(inputs, runs.peaks[own]), self.system.playing(inputs[:, self.given :])
            assert self.program.margins is not None
            now = self.program.margins(self._consistent(inputs) if self.jumper.guards_read_rates else inputs)
            due = self._due(now, playing, sizes, inputs, runs.jumped[own, -1])
            # Beyond a limit, or where edges follow each other without end, a run is looked at by itself.
            beyond = self.terminal & playing[:, limits] & (now[:, limits] < -self.slack * sizes[:, limits])
            endless = runs.jumped[own, 0] >= t - REACHED * np.maximum(t, BRIEF * runs.breaks[own, -1])
            has_jumped = runs.jumped[own, -1] >= 0
            runs.leave(own[(has_jumped & beyond.any(axis=1)) | (due == UNKNOWN) | endless])
            jumps = runs.going[own] & (due != NONE)
            for index in np.unique(due[jumps]).tolist():
                self._apply(runs, own[jumps & (due == index)], index)
            own = own[jumps & runs.going[own]]

    def _due(self, now: Array, playing: Mask, sizes: Array, inputs: Array, jumped: Array) -> Index:
        """The edge that is due in each run: NONE, or UNKNOWN where that depends on what has happened before."""
        now, sizes, played = now[:, self.first :], sizes[:, self.first :], playing[:, self.first :]
        small = CROSSED * sizes
        closed = played & (now < -np.maximum(drift_of(self.problem.rtol) * sizes, small))
        near = played & ~closed & (now <= small) & ~self.strict
        some = near.any(axis=1)
        if some.any():
            near[some] &= self.jumper.guard_rates(self._consistent(inputs[some])) < 0
        closed |= near
        due = np.where(closed.any(axis=1), closed.argmax(axis=1), NONE)
        return np.where(near.any(axis=1) & (jumped == inputs[:, 0]), UNKNOWN, due)

    def _apply(self, runs: _Runs, own: Index, index: int) -> None:
        """Carry out an edge in these runs and book it."""
        before = runs.inputs[own]
        noise = CROSSED * self._sizes(before, runs.peaks[own])[:, self.first + index]
        jumps, after = self.jumper.make_all(index, before, noise)
        for j, account in enumerate(self.system.ledger):
            runs.booked[own, j] += booked(jumps, account, self.jumper.states)
        edge, ledger = np.full((len(own), 1), self.first + index), np.zeros((len(own), self.accounts))
        runs.events.append((own, np.concatenate([edge, before[:, : self.given], ledger], axis=1)))
        runs.inputs[own] = after
        runs.jumped[own] = np.column_stack([runs.jumped[own, 1:], before[:, 0]])
        if self.first + index in self.returns:
            times = self.jumper.times_of_return(after).max(axis=1)
            runs.returning[own] = np.column_stack([before[:, 0], times])
        runs.leave(own[~jumps.goes_on])

    # -- between ------------------------------------------------------------------------------------------------------

    def _flow(self, runs: _Runs, times: Array, spacing: Array) -> None:
        """The next arc of all runs that go on, those in the same modes together."""
        own = np.flatnonzero(runs.going)
        inputs, t = runs.inputs[own], runs.inputs[own, 0]
        goes_on, length = runs.segment[own] + 1 < runs.table.shape[1], self._length(runs, own)
        # What has just rebounded, and soon may again, has a piece of its own.
        since, back = runs.returning[own].T
        aloft = np.where(since == t, back, 0.0)
        soon = (aloft > 0) & (ALOFT * aloft < FITTED * length)
        seen = self._sizes(inputs, runs.peaks[own])
        seen[:, self.returns] = np.where(aloft[:, None] > 0, 0.0, np.maximum(seen[:, self.returns], MICROMETRE))
        runs.arcs.append((own, inputs.copy()))
        inputs[:, self.start] = t
        inputs[:, self.origins] -= t[:, None]
        kinds = np.column_stack([self.system.playing(inputs[:, self.given :]), goes_on, soon])
        for kind in np.unique(kinds, axis=0):
            alike = (kinds == kind).all(axis=1)
            some, left = own[alike], self._left(runs, own[alike], times, length[alike])
            inside = [ALOFT * aloft[alike]] if kind[-1] else []
            segments = np.column_stack([np.zeros(len(some)), *inside, length[alike]])
            table = np.repeat(inputs[alike, None, self.given :], segments.shape[1] - 1, axis=1)
            peaks = np.concatenate([runs.exchanged[some], seen[alike]], axis=1)
            problem = replace(self.problem, in_play=tuple(kind[:-2].tolist()), goes_on=bool(kind[-2]), times=left[0])
            y0 = inputs[alike, 1 : 1 + self.n]
            for which, batch in _solved(problem, y0, table, spacing[some], peaks, segments, left):
                self._take(runs, some[which], batch)

    def _length(self, runs: _Runs, own: Index) -> Array:
        """How long arcs may last: not to a breakpoint that no load has, as a formula there is that of what follows."""
        t, end, segment = runs.inputs[own, 0], runs.end[own], runs.segment[own]
        following = np.minimum(segment + 1, runs.table.shape[1] - 1)
        same = (following > segment) & (runs.table[own, segment] == runs.table[own, following]).all(axis=1)
        return np.where(same, np.maximum(end - DIGITS * end, 0.5 * (t + end)), end) - t

    def _left(self, runs: _Runs, own: Index, times: Array, length: Array) -> Array:
        """The outputs of a segment not reached yet, in the time of an arc; infinite where there are none left."""
        written, most = runs.counts[own, OUTPUTS], times.shape[1]
        which = written[:, None] + np.arange(most - int(written.min()))
        found = times[own[:, None], np.minimum(which, most - 1)]
        local = np.clip(found - runs.inputs[own, :1], 0.0, length[:, None])
        return np.where((which < most) & (found <= runs.end[own, None]), local, np.inf)

    def _take(self, runs: _Runs, own: Index, batch: Any) -> None:
        """What the stepper has written of an arc, in the time and ledger of the run; then the edge at its end."""
        counts, end, t = batch.counts, runs.end[own], runs.inputs[own, 0]
        self._write(runs, own, batch, t)
        finished, event = counts[:, END] == Status.FINISHED, counts[:, END] == Status.EVENT
        runs.counts[own, OUTPUTS] += counts[:, OUTPUTS]
        runs.counts[own, FIRST_COUNTER:] += counts[:, FIRST_COUNTER:STOP]
        enough = runs.counts[own, FIRST_COUNTER] < self.problem.max_steps
        ends, ledger = batch.ends.copy(), slice(self.given, self.given + self.accounts)
        ends[:, 0] = np.where(finished, end, np.minimum(t + ends[:, 0], end))
        runs.booked[own] += ends[:, ledger]
        runs.exchanged[own] = np.maximum(runs.exchanged[own], np.abs(runs.booked[own]))
        runs.peaks[own] = np.fmax(runs.peaks[own], np.abs(ends[:, 1 : 1 + self.n]))
        runs.ends[own], runs.inputs[own, : self.given] = ends, ends[:, : self.given]
        runs.leave(own[~(finished | event) | ~enough])
        self._end(runs, own, batch, event & runs.going[own])
        self._begin(runs, own[runs.going[own] & (runs.inputs[own, 0] >= runs.end[own])])

    def _begin(self, runs: _Runs, own: Index) -> None:
        """The next segment of runs at the end of one, with the modes that hold; those without another have ended."""
        over = runs.segment[own] + 2 == runs.breaks.shape[1]
        runs.going[own[over]] = False
        own = own[~over]
        runs.segment[own] += 1
        segment, modes = runs.segment[own], [self.given + j for j in self.jumper.mode_columns]
        inputs = runs.inputs[own]
        inputs[:, 0], inputs[:, 1 + self.n : self.given] = runs.breaks[own, segment], 0.0
        inputs[:, self.given :] = runs.table[own, segment]
        inputs[:, modes] = runs.inputs[own][:, modes]
        runs.inputs[own] = inputs

    def _write(self, runs: _Runs, own: Index, batch: Any, t: Array) -> None:
        """Outputs, kinks and steps of an arc that began at these times."""
        counts, n = batch.counts, self.n
        i, k = np.nonzero(np.arange(batch.outputs.shape[1]) < counts[:, OUTPUTS, None])
        outputs = batch.outputs[i, k]
        outputs[:, n:] += runs.booked[own[i]]
        runs.outputs[own[i], runs.counts[own[i], OUTPUTS] + k] = outputs
        happened = np.arange(batch.events.shape[1]) < counts[:, EVENTS, None]
        i, k = np.nonzero(happened & (batch.events[..., 0] < self.first))
        kinks = batch.events[i, k]
        kinks[:, 1] += t[i]
        runs.events.append((own[i], kinks))
        taken = np.arange(int(counts[:, RECORDS].max())) < counts[:, RECORDS, None]
        i, k = np.nonzero(taken)
        steps, states = batch.records[i, k], np.zeros((*taken.shape, n))
        states[i, k] = np.abs(steps[:, 1 : 1 + n])
        runs.peaks[own] = np.fmax(runs.peaks[own], states.max(axis=1, initial=0.0))
        steps[:, 0] += t[i]
        # The start of an arc, and what time cannot tell from it, is the event that ended the last one.
        later = (steps[:, 0] > t[i]) | (runs.counts[own[i], RECORDS] == 0)
        runs.counts[own, RECORDS] += np.bincount(i[later], minlength=len(own))
        if self.keeps_steps:
            runs.records.append((own[i[later]], steps[later]))

    def _end(self, runs: _Runs, own: Index, batch: Any, event: Mask) -> None:
        """Carry out the edges at which arcs have ended; of what else they end with a run tells by itself."""
        index, at = batch.events[..., 0], batch.events[..., 1]
        every, count = np.arange(len(own)), batch.counts[:, EVENTS]
        happened = event[:, None] & (np.arange(index.shape[1]) < count[:, None])
        last = np.maximum(count, 1) - 1
        ended = np.where(event, index[every, last], self.first).astype(np.int64) - self.first
        limit = happened & (at == at[every, last][:, None]) & np.isin(index, np.flatnonzero(self.terminal))
        margins, playing = batch.ends[:, -self.program.n_margins :], self.system.playing(runs.inputs[own, self.given :])
        unseen = np.zeros(len(own), dtype=bool)
        for j in self.returns:  # a gap that has closed
            unseen |= playing[:, j] & (margins[:, j] < -PICOMETRE) & ~(happened & (index == j)).any(axis=1)
        stopped = ended < 0
        runs.leave(own[unseen | (limit.any(axis=1) & ~stopped)])
        runs.going[own[stopped]], runs.counts[own[stopped], END] = False, Status.EVENT
        event = event & runs.going[own]
        for edge in np.unique(ended[event]).tolist():
            self._apply(runs, own[event & (ended == edge)], edge)

    # -- all arcs of a run --------------------------------------------------------------------------------------------

    def _course(self, runs: _Runs) -> Course:
        """The arcs of all runs, one behind the other."""
        count, width = len(runs.told), self.given + self.accounts
        arcs, lasting = _table(runs.arcs, count, runs.inputs.shape[1])
        arcs[np.arange(arcs.shape[1]) >= lasting[:, None], 0] = np.inf
        segments = np.column_stack([arcs[:, :, 0], np.full(count, np.inf)])
        events, runs.counts[:, EVENTS] = _table(runs.events, count, 1 + width)
        records, _ = _table(runs.records, count, width)
        written = runs.counts, runs.ends, runs.outputs, events, records
        return Course(runs.told, *written, segments, arcs[:, :, self.given :])


def _solved(problem: Problem, *columns: Array) -> Iterator[tuple[Index, Any]]:
    """Arcs in batches, each with the places of its own; those for which there was no room again with what they need."""
    batch = solve_arrays(problem, *columns, room=ROOM)
    needed = batch.counts[:, [RECORDS, EVENTS]]
    short = (needed > ROOM[:2]).any(axis=1)
    if short.any():
        steps, events = np.maximum(needed[short].max(axis=0), ROOM[:2]).tolist()
        again = solve_arrays(problem, *(column[short] for column in columns), room=(steps, events, 0))
        yield np.flatnonzero(short), again
        batch = batch._replace(**{name: getattr(batch, name)[~short] for name in WRITTEN})
    if not short.all():
        yield np.flatnonzero(~short), batch


def _table(parts: list[tuple[Index, Array]], count: int, width: int) -> tuple[Array, Index]:
    """What happens to runs as a table of them in order of time, zero beyond the last of each, and how many each has."""
    counts = sum((np.bincount(owner, minlength=count) for owner, _ in parts), np.zeros(count, np.int64))
    table, written = np.zeros((count, int(counts.max(initial=0)), width)), np.zeros(count, np.int64)
    for owner, found in parts:
        # Those of one run stand one behind the other.
        first = np.flatnonzero(np.diff(owner, prepend=-1))
        place = np.arange(len(owner)) - np.repeat(first, np.diff(np.append(first, len(owner))))
        table[owner, written[owner] + place] = found
        written += np.bincount(owner, minlength=count)
    return table, counts
