"""
Throughput of examples/many_cloths.py, for docs/howto/many_cloths.md.

    python -m tools.throughput [CLOTHS]
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe_in_a_line

from .marked_block import fill

_COMMAND = 'python -m tools.throughput'
_ROOT = Path(__file__).parent.parent
_SECONDS = 20.0  # simulated time of a cloth


def measure(cloths: int, workers: int) -> float:
    """Return the simulated seconds per second, of gust.yaml with so many workers (0: no Dask)."""
    with tempfile.TemporaryDirectory() as folder:
        vary = ('--vary', 'wind.gust.seed', f'0:{cloths}', '--seconds', str(_SECONDS))
        command = [sys.executable, 'examples/many_cloths.py', 'config/gust.yaml', *vary]
        command += ['--workers', str(workers), '--out', f'{folder}/cloths.h5']
        printed = subprocess.run(command, cwd=_ROOT, text=True, check=True, stdout=subprocess.PIPE)
    (number,) = re.findall(r', ([\d.]+) s of simulated time per second', printed.stdout)
    return float(number)


def main() -> None:
    """Measure with one process and with one on each core, and write the table."""
    cloths = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    cores = os.cpu_count() or 1
    names = {0: 'this process, without Dask'} | {
        count: f'{count} worker{"s" * (count > 1)}' for count in sorted({1, cores})
    }
    rates = {workers: measure(cloths, workers) for workers in names}
    rows = [
        [name, f'{rates[workers]:.3g}', f'{rates[workers] / rates[0]:.2f}']
        for workers, name in names.items()
    ]
    header = ['processes', 'simulated seconds per second', 'beside one process']
    machine = describe_in_a_line()
    text = (
        f'{cloths} cloths of `gust.yaml` for {_SECONDS:g} s each, the start of the workers '
        f'included:\n\n{table(header, rows)}\n\nMeasured by `{_COMMAND} {cloths}` on: {machine}.'
    )
    fill(_ROOT / 'docs' / 'howto' / 'many_cloths.md', _COMMAND, text)
    print(text)


if __name__ == '__main__':
    main()
