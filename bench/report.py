"""
Report of `make bench`: page, plot and short JSON from the results of pytest-benchmark.

    python -m bench.report RESULT.json FOLDER
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import matplotlib

from cloth_ros.tradeoff.formatting import table
from tools.marked_block import fill

from .contact_report import contact_section, drop_section

# Operations of a substep with all springs and gravity, per particle: for each of 12 springs, 3
# subtractions, 5 operations for the squared length, 2 for the tension and 6 to add the force; 18
# for kick, decay and drift.
_OPERATIONS = 12 * 16 + 18
_ROOTS = 12
# Bytes per particle in single precision: positions and velocities read and written, pins read.
_BYTES = 52

# Names in the page for what `test_limits` measures.
_LIMITS = {
    'additions and multiplications': 'additions and multiplications',
    'reciprocal roots': 'reciprocal square roots',
    'bytes moved': 'bytes of memory traffic',
}

Entry = dict[str, Any]


def load(path: Path) -> dict[str, Any]:
    """Return machine and statistics of each benchmark, without the times of single rounds."""
    result = json.loads(path.read_text())
    entries = []
    for benchmark in result['benchmarks']:
        stats = benchmark['stats']
        entry = dict(benchmark['extra_info'])
        entry |= {name: stats[name] for name in ('median', 'min', 'max', 'q1', 'q3', 'rounds')}
        entries.append(entry)
    return {'machine': result['machine_info'], 'entries': entries}


def _per_step(entry: Entry, key: str = 'median') -> float:
    """Return the time per particle and substep, ns."""
    return float(1e9 * entry[key] / entry['steps'])


def _threads(count: int) -> str:
    return f'{count} thread' + 's' * (count > 1)


def _spread(entry: Entry) -> str:
    median, low, high = (_per_step(entry, key) for key in ('median', 'q1', 'q3'))
    return f'{median:.2f} ({low:.2f} to {high:.2f})'


class Report:
    """Texts and plot of a result of `make bench`."""

    def __init__(self, result: dict[str, Any]) -> None:
        self._result = result
        self._entries: list[Entry] = result['entries']

    def _select(self, table: str, **wanted: object) -> list[Entry]:
        return [
            entry
            for entry in self._entries
            if entry['table'] == table
            and all(entry.get(key) == value for key, value in wanted.items())
        ]

    def limit(self) -> float:
        """Return the time of the arithmetic of a substep alone, ns per particle."""
        rates = {
            entry['what']: entry['steps'] / entry['median']
            for entry in self._select('limit', precision='single')
        }
        operations = _OPERATIONS / rates['additions and multiplications']
        return float(1e9 * (operations + _ROOTS / rates['reciprocal roots']))

    def memory_limit(self) -> float:
        """Return the time of the memory traffic of a substep alone, ns per particle."""
        (entry,) = self._select('limit', what='bytes moved')
        return float(1e9 * _BYTES / (entry['steps'] / entry['median']))

    def text(self) -> str:
        """Return the page."""
        machine = ', '.join(f'{name} {value}' for name, value in self._result['machine'].items())
        lines = [
            '# Cost of a substep',
            '',
            'Written by `make bench`. Values are medians, with the quartiles in parentheses.',
            '',
            f'Machine: {machine}.',
            '',
            '![Cost of a substep by size of the sheet](cost.png)',
            '',
            '## Cost by size of the sheet',
            '',
            'Nanoseconds per particle and substep of position Verlet, with all three types of '
            'springs and gravity.',
            '',
            *self._sizes(),
            *self._limits(),
            *self._effects(),
            *contact_section(self._select('contact')),
            *self._engines(),
            *drop_section(self._select('drop')),
        ]
        return '\n'.join(lines).rstrip() + '\n'

    def _sizes(self) -> list[str]:
        columns = sorted(
            {(entry['precision'], entry['threads']) for entry in self._select('size')},
            key=lambda column: (column[0] == 'double', column[1]),
        )
        names = [f'{precision}, {_threads(threads)}' for precision, threads in columns]
        rows = []
        for size in sorted({entry['size'] for entry in self._select('size')}):
            row: list[object] = [f'{size} × {size}']
            for precision, threads in columns:
                found = self._select('size', size=size, precision=precision, threads=threads)
                row += [_spread(entry) for entry in found] or ['']
            rows.append(row)
        return [table(['sheet', *names], rows), '']

    def _limits(self) -> list[str]:
        lines = [
            '## Comparison with the limit of the processor',
            '',
            f'Per particle, a substep takes {_OPERATIONS} additions and multiplications, '
            f'{_ROOTS} reciprocal square roots, and, for sheets larger than the caches, {_BYTES} '
            'bytes of memory traffic. Rates measured on one core in single precision:',
            '',
        ]
        rows = [
            (_LIMITS[entry['what']], f'{1e-9 * entry["steps"] / entry["median"]:.1f}')
            for entry in self._select('limit', precision='single')
        ]
        lines += [table(['quantity', 'rate [10⁹/s]'], rows), '']
        limit, memory = self.limit(), self.memory_limit()
        lines += [
            f'These rates allow {limit:.2f} ns for the arithmetic, and {memory:.2f} ns for the '
            'memory traffic. The limit is the arithmetic, and for 1024 × 1024 the larger of the '
            'two. Limit / measured time, one thread:',
            '',
        ]
        rows = []
        for size in (64, 128, 256, 1024):
            for entry in self._select('size', size=size, precision='single', threads=1):
                bound = max(limit, memory) if size >= 1024 else limit
                rows.append((f'{size} × {size}', f'{100 * bound / _per_step(entry):.0f} %'))
        return [*lines, table(['sheet', 'share'], rows), '']

    def _effects(self) -> list[str]:
        base = _per_step(self._select('effect', effect='all springs and gravity')[0])
        rows = [
            (entry['effect'], _spread(entry), f'{100 * (_per_step(entry) / base - 1):+.0f} %')
            for entry in self._select('effect')
        ]
        return [
            '## Cost of each effect',
            '',
            '128 × 128, single precision, one thread. Air and dashpots are evaluated in one of '
            'several substeps, more often the stronger they are.',
            '',
            table(['scene', 'time [ns]', 'difference to all springs and gravity'], rows),
            '',
        ]

    def _engines(self) -> list[str]:
        lines = [
            '## Comparison with other engines',
            '',
            'Real-time factor (simulated time / wall-clock time) of a sheet of 1 m × 1 m and '
            '0.2 kg that hangs from two corners, with one thread and 60 ticks per second. Each '
            'engine has the fastest setting found that is stable and does not stretch too far; '
            'the models differ, so the table also lists the largest strain after 1 s. The NumPy '
            'and Taichi programs make as many substeps as are stable in every state; this package '
            'fewer where the present state allows it.',
            '',
        ]
        rows = []
        for entry in sorted(self._select('engine'), key=lambda e: (e['size'], e['median'])):
            own = self._select('engine', size=entry['size'], engine='cloth_ros')[0]
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
        header = ['sheet', 'engine', 'real-time factor', 'time / ours', 'strain', 'settings']
        return [*lines, table(header, rows), '']

    def draw(self, folder: Path) -> None:
        """Write ``cost.png`` and ``cost.svg``."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.4, 5.0), layout='constrained')
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        for precision, colour in (('single', '#0072b2'), ('double', '#b84a00')):
            for threads, style in ((1, 'o-'), (2, 's--')):
                entries = self._select('size', precision=precision, threads=threads)
                if entries:
                    label = f'{precision} precision, {_threads(threads)}'
                    self._line(axes, entries, style, colour, label)
        for name, style, colour in (('NumPy', '^:', '#333333'), ('Taichi', 'v-.', '#117733')):
            entries = [
                {**entry, 'steps': entry['particle_steps']}
                for entry in self._select('engine')
                if entry['engine'].startswith(name)
            ]
            if entries:
                self._line(axes, entries, style, colour, f'{entries[0]["engine"]}, 1 thread')
        axes.axhline(
            self.limit(),
            color='#888888',
            linewidth=4,
            alpha=0.4,
            label='arithmetic alone, single precision, 1 thread',
        )
        axes.set_xscale('log', base=2)
        axes.set_yscale('log')
        axes.set_ylim(bottom=1)
        axes.xaxis.set_major_formatter('{x:g}²')
        axes.yaxis.set_major_formatter('{x:g}')
        axes.set_xlabel('particles')
        axes.set_ylabel('ns per particle and substep')
        axes.set_title(f'Cost of a substep: {self._result["machine"]["processor"]}')
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
        for entry in self._select('engine'):
            engines.setdefault(entry['engine'], {})[entry['size']] = entry
        sizes = sorted({entry['size'] for entry in self._select('engine')})
        rows = [
            [name, *(f'{1 / 60 / of[size]["median"]:.3g}' if size in of else '' for size in sizes)]
            for name, of in engines.items()
        ]
        header = ['real-time factor, one thread', *(f'{size} × {size}' for size in sizes)]
        machine = self._result['machine']
        where = f'{machine["processor"]}, {machine["vector instructions"]}'
        return f'{table(header, rows)}\n\nMeasured on: {where}.'

    def insert(self, readme: Path) -> None:
        """Write the summary between its marks in the README."""
        fill(readme, 'make bench', self.summary())


def main() -> None:
    """Write the page, the plot, the short JSON and the table of the README."""
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
