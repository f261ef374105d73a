"""The faults of `make faults`, each in a short form, on real processes."""

import json
import os
import sys
from types import SimpleNamespace

import pytest

from reliability import record
from reliability.arrivals import OK, Arrival, Report, Ticks
from reliability.faults import ALONE, SCENE, SHARED
from reliability.faults.__main__ import tried
from reliability.faults.cannot import CannotDoError
from reliability.live import Live, Process, live
from reliability.record import Row

# One compiles everything anew, several times; the other is in test_node.py.
_ELSEWHERE = ('compiling', 'clock_jumps')
_SHARED, _ALONE = (
    [fault for fault in faults if fault.__name__ not in _ELSEWHERE] for faults in (SHARED, ALONE)
)


@pytest.fixture(scope='module')
def running():
    """A node that bears all of them, one after the other."""
    with live(*SCENE) as node:
        yield node


@pytest.mark.parametrize('fault', _SHARED, ids=lambda fault: fault.__name__)
def test_a_running_node_outlives(fault, running):
    row = fault(running, quick=True)
    assert row.kept, row.measured


@pytest.mark.parametrize('fault', _ALONE, ids=lambda fault: fault.__name__)
def test_a_node_outlives(fault):
    try:
        row = fault(quick=True)
    except CannotDoError as reason:
        pytest.skip(str(reason))
    assert row.kept, row.measured


def test_what_a_process_prints_is_whole_while_it_is_read():
    count = 20_000
    lines = f'for n in range({count}): print(n, flush=True)'
    process = Process((sys.executable, '-c', lines), dict(os.environ))
    while process.alive:
        assert '0\n'.startswith(process.output[:2])
    assert process.output.split() == [str(n) for n in range(count)]


def heard(times: list[float]) -> Live:
    """A node of which messages came at these times, and whose reports are all well."""

    def spin_until(condition, patience):
        assert condition(), 'waited in vain'

    particles = [Arrival(at, at, at, number) for number, at in enumerate(times)]
    reports = [Report(times[-1] - n, OK, '', {}) for n in (1.0, 0.0)]
    listener = SimpleNamespace(particles=particles, reports=reports, spin_until=spin_until)
    return Live(0, None, listener, 60.0)


def test_a_burst_of_messages_is_no_full_rate():
    burst = [10.0 + 1e-3 * n for n in range(40)]
    with pytest.raises(AssertionError, match='in vain'):
        heard([*burst, 12.0]).recover(0.0)
    steady = [20.0 + n / 60 for n in range(90)]
    assert heard(burst + steady).recover(0.0) == 20.0


def test_ticks_that_are_late_lost_or_missing_are_noticed():
    regular = [n / 60 for n in range(600)]
    assert heard(regular).ticks(0.0, 10.0).as_before
    silent = heard(regular).ticks(20.0, 30.0)
    assert (silent.count, silent.missing, silent.text) == (0, 600, 'no messages')
    assert not silent.all_arrived
    assert not heard(regular[:300]).ticks(0.0, 10.0).as_before, 'it fell silent'
    late = [at + 0.02 * (n % 20 == 0) for n, at in enumerate(regular)]
    assert heard(late).ticks(0.0, 10.0).late == 29
    assert not heard(late).ticks(0.0, 10.0).as_before
    assert not Ticks(599, 0, 0, 0.017, lost=1).as_before


def test_what_cannot_be_made_or_fails_is_not_kept():
    def impossible(quick):
        """Something impossible."""
        raise CannotDoError('needs a miracle')

    def failing(quick):
        """Something that fails."""
        raise ValueError('of one\nor two lines')

    row = tried(impossible, True)
    assert (row.what, row.measured, row.kept) == (
        'Something impossible',
        'not tried here: needs a miracle',
        False,
    )
    row = tried(failing, True)
    assert (row.measured, row.kept) == ('ValueError: of one or two lines', False)


@pytest.mark.parametrize('full', [True, False])
def test_only_full_runs_are_written(full, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(record, 'RESULTS', tmp_path)
    row = Row('what', 'promised', 'measured', kept=False)
    assert not record.write('name', 'make it', 'Title', 'summary', [row], full=full)
    written = list(tmp_path.iterdir())
    assert bool(written) == full
    assert ('no full run' in capsys.readouterr().out) != full
    if full:
        assert json.loads(written[0].read_text())['commit'].strip()
