"""
Turn what pytest-benchmark has measured into a table, a plot and a short JSON.

    python -m bench.report RESULT.json FOLDER
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import matplotlib

from cloth_ros.tradeoff.report import table
from tools.marked_block import fill

# Of a substep with all springs and gravity, per particle: 12 springs of 3 subtractions, 5
# operations for the squared length, 2 for the tension and 6 to add it; kick, decay and drift take
# 18 more.
_OPERATIONS = 12 * 16 + 18
_ROOTS = 12
# Positions and velocities read, both written, and whether the particle moves; single precision.
_BYTES = 52

Entry = dict[str, Any]


def load(path: Path) -> dict[str, Any]:
    """Return the machine and what was measured, without the bulk of single runs."""
    result = json.loads(path.read_text())
    entries = []
    for benchmark in result['benchmarks']:
        stats = benchmark['stats']
        entry = dict(benchmark['extra_info'])
        entry |= {name: stats[name] for name in ('median', 'min', 'max', 'q1', 'q3', 'rounds')}
        entries.append(entry)
    return {'machine': result['machine_info'], 'entries': entries}


def _per_step(entry: Entry, key: str = 'median') -> float:
    """Return ns per particle and substep."""
    return float(1e9 * entry[key] / entry['steps'])


def _spread(entry: Entry) -> str:
    median, low, high = (_per_step(entry, key) for key in ('median', 'q1', 'q3'))
    return f'{median:.2f} ({low:.2f} to {high:.2f})'


class Report:
    """The result of `make bench`, in words."""

    def __init__(self, result: dict[str, Any]) -> None:
        self._result = result
        self._entries: list[Entry] = result['entries']

    def _of(self, table: str, **wanted: object) -> list[Entry]:
        return [
            entry
            for entry in self._entries
            if entry['table'] == table
            and all(entry.get(key) == value for key, value in wanted.items())
        ]

    def limit(self) -> float:
        """Return what the arithmetic of a substep would take alone, ns per particle."""
        rates = {
            entry['what']: entry['steps'] / entry['median']
            for entry in self._of('limit', precision='single')
        }
        operations = _OPERATIONS / rates['additions and multiplications']
        return float(1e9 * (operations + _ROOTS / rates['reciprocal roots']))

    def memory_limit(self) -> float:
        """Return what moving the particles through memory would take alone, ns per particle."""
        (entry,) = self._of('limit', what='bytes moved')
        return float(1e9 * _BYTES / (entry['steps'] / entry['median']))

    def text(self) -> str:
        """Return the page."""
        machine = ', '.join(f'{name} {value}' for name, value in self._result['machine'].items())
        lines = [
            '# What a substep costs',
            '',
            'Made by `make bench`. Medians, and in brackets the quartiles.',
            '',
            f'Machine: {machine}.',
            '',
            '![Cost by size](cost.png)',
            '',
            '## By size',
            '',
            'Nanoseconds per particle and substep of position Verlet, with springs of all '
            'families and gravity.',
            '',
            *self._sizes(),
            *self._limits(),
            *self._effects(),
            *self._engines(),
        ]
        return '\n'.join(lines).rstrip() + '\n'

    def _sizes(self) -> list[str]:
        columns = sorted(
            {(entry['precision'], entry['threads']) for entry in self._of('size')},
            key=lambda column: (column[0] == 'double', column[1]),
        )
        names = [f'{precision}, {threads} thread(s)' for precision, threads in columns]
        rows = []
        for size in sorted({entry['size'] for entry in self._of('size')}):
            row: list[object] = [f'{size} × {size}']
            for precision, threads in columns:
                found = self._of('size', size=size, precision=precision, threads=threads)
                row += [_spread(entry) for entry in found] or ['']
            rows.append(row)
        return [table(['sheet', *names], rows), '']

    def _limits(self) -> list[str]:
        lines = [
            '## Beside the limit of the machine',
            '',
            f'A substep takes {_OPERATIONS} additions and multiplications and {_ROOTS} reciprocal '
            f'roots a particle, and moves {_BYTES} bytes where the sheet is in no cache. Measured '
            'here, on one core, in single precision:',
            '',
        ]
        rows = [
            (entry['what'], f'{1e-9 * entry["steps"] / entry["median"]:.1f} thousand million/s')
            for entry in self._of('limit', precision='single')
        ]
        lines += [table(['what', 'rate'], rows), '']
        limit, memory = self.limit(), self.memory_limit()
        lines += [
            f'That alone is {limit:.2f} ns of arithmetic, and {memory:.2f} ns of memory outside '
            'the caches. Share of the greater one that the solver reaches, with one thread:',
            '',
        ]
        rows = []
        for size in (64, 128, 256, 1024):
            for entry in self._of('size', size=size, precision='single', threads=1):
                bound = max(limit, memory) if size >= 1024 else limit
                rows.append((f'{size} × {size}', f'{100 * bound / _per_step(entry):.0f} %'))
        return [*lines, table(['sheet', 'share'], rows), '']

    def _effects(self) -> list[str]:
        base = _per_step(self._of('effect', effect='all springs and gravity')[0])
        rows = [
            (entry['effect'], _spread(entry), f'{100 * (_per_step(entry) / base - 1):+.0f} %')
            for entry in self._of('effect')
        ]
        lines = [
            '## What an effect costs',
            '',
            '128 × 128, single precision, one thread. Air and dashpots act in one of several '
            'substeps, the fewer the stronger they are.',
            '',
            table(['scene', 'ns', 'beside all springs and gravity'], rows),
            '',
            'A free sheet of 64 × 64 particles that lies on a sphere:',
            '',
        ]
        rows = [
            (f'{entry["radius"]:g} m', entry['touching'], _spread(entry))
            for entry in self._of('contact')
        ]
        return [*lines, table(['radius', 'particles near the sphere', 'ns'], rows), '']

    def _engines(self) -> list[str]:
        lines = [
            '## Beside other engines',
            '',
            'How many times faster than real time a sheet of 1 m and 0.2 kg hangs from two '
            'corners, one thread, 60 ticks a second. Their models differ, so the largest strain '
            'after a second stands beside it. NumPy and Taichi make the same steps as '
            'this solver.',
            '',
        ]
        rows = []
        for entry in sorted(self._of('engine'), key=lambda e: (e['size'], e['median'])):
            own = self._of('engine', size=entry['size'], engine='cloth_ros')[0]
            rows.append(
                (
                    f'{entry["size"]} × {entry["size"]}',
                    entry['engine'],
                    f'{1 / 60 / entry["median"]:.3g}',
                    f'{entry["median"] / own["median"]:.3g}',
                    f'{entry["strain"]:.2f}',
                    entry['settings'],
                )
            )
        header = ['sheet', 'engine', 'real-time factor', 'times slower', 'strain', 'settings']
        return [*lines, table(header, rows), '']

    def draw(self, folder: Path) -> None:
        """Write ``cost.png`` and ``cost.svg``."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.4, 5.0), layout='constrained')
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        for precision, colour in (('single', '#1b6ca8'), ('double', '#c8553d')):
            for threads, style in ((1, 'o-'), (2, 's--')):
                entries = self._of('size', precision=precision, threads=threads)
                if entries:
                    label = f'{precision} precision, {threads} thread' + 's' * (threads > 1)
                    self._line(axes, entries, style, colour, label)
        for name, colour in (('NumPy', '#6b4e71'), ('Taichi', '#3a7d44')):
            entries = [
                {**entry, 'steps': entry['particle_steps']}
                for entry in self._of('engine')
                if entry['engine'].startswith(name)
            ]
            if entries:
                self._line(axes, entries, '^:', colour, f'{entries[0]["engine"]}, the same steps')
        axes.axhline(
            self.limit(),
            color='#888888',
            linewidth=4,
            alpha=0.4,
            label='the arithmetic of a step alone, single precision',
        )
        axes.set_xscale('log', base=2)
        axes.set_yscale('log')
        axes.set_ylim(bottom=1)
        axes.xaxis.set_major_formatter('{x:g}²')
        axes.yaxis.set_major_formatter('{x:g}')
        axes.set_xlabel('particles of the sheet')
        axes.set_ylabel('ns per particle and substep')
        axes.set_title(f'What a substep costs: {self._result["machine"]["processor"]}')
        axes.grid(alpha=0.3, which='both')
        axes.legend()
        for kind in ('png', 'svg'):
            with matplotlib.rc_context({'svg.hashsalt': 'cloth_ros'}):
                metadata = {'Date': None} if kind == 'svg' else None
                figure.savefig(folder / f'cost.{kind}', dpi=110, metadata=metadata)

    @staticmethod
    def _line(axes: Any, entries: list[Entry], style: str, colour: str, label: str) -> None:
        entries = sorted(entries, key=lambda entry: entry['size'])
        sizes = [entry['size'] for entry in entries]
        axes.plot(sizes, [_per_step(entry) for entry in entries], style, color=colour, label=label)

    def summary(self) -> str:
        """Return the table for the README: real-time factors by engine and size."""
        engines: dict[str, dict[int, Entry]] = {}
        for entry in self._of('engine'):
            engines.setdefault(entry['engine'], {})[entry['size']] = entry
        sizes = sorted({entry['size'] for entry in self._of('engine')})
        rows = [
            [name, *(f'{1 / 60 / of[size]["median"]:.3g}' if size in of else '' for size in sizes)]
            for name, of in engines.items()
        ]
        header = ['times real time, one thread', *(f'{size} × {size}' for size in sizes)]
        machine = self._result['machine']
        where = f'{machine["processor"]}, {machine["vector instructions"]}'
        return f'{table(header, rows)}\n\nMeasured on: {where}.'

    def insert(self, readme: Path) -> None:
        """Put the summary into the README, between its marks."""
        fill(readme, 'make bench', self.summary())


def main() -> None:
    """Write the page, the plot, the JSON and the README's table."""
    source, folder = Path(sys.argv[1]), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    result = load(source)
    report = Report(result)
    (folder / 'result.json').write_text(json.dumps(result, indent=1) + '\n')
    (folder / 'README.md').write_text(report.text())
    report.draw(folder)
    report.insert(Path('README.md'))
    print(report.text())


if __name__ == '__main__':
    main()
