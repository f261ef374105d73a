"""Bad command lines."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from cloth_ros.tradeoff.main import main as tradeoff

from .fuzz_files import READY, damaged, whole
from .live import NODE, ROOT, Process, environment, free_domain
from .tally import Tally

_PATIENCE = 60.0  # s, for a process to say no, or to run
_RUNNING = 'publishing'
_LONGEST = 1500  # characters of a complaint, what rcl quotes among them
_QOS = 'qos_overrides./cloth/particles.publisher'
NODE_ARGUMENTS: list[list[str]] = [
    *(['--help'], ['-h'], ['config/gust.yaml'], ['--foo'], ['--'], [''], ['\udcff'], ['--quick']),
    *(['--ros-args', *rest] for rest in (['--foo'], ['foo'], ['-p'], ['-r'], ['--params-file'])),
    *(['--ros-args', '-p', rule] for rule in ('rate', 'rate:=', ':=3', 'a b:=3', 'rate:=[1', '=')),
    *(
        ['--ros-args', '-p', f'rate:={x}']
        for x in ('fast', '.nan', '0', '1e400', 'true', '[60.0]')
    ),
    *(['--ros-args', '-p', f'rate:={x}'] for x in ('!!python/object:os.system x', '*a', '"60"')),
    *(
        ['--ros-args', '-p', f'sheet.rows:={x}']
        for x in ('0', '1025', '2.5', '9' * 30, '-1', '{}')
    ),
    *(
        ['--ros-args', '-p', f'gravity:={x}']
        for x in ('[1,2]', '[a,b,c]', '[[1]]', '{a: 1}', '[.nan,0.0,0.0]')
    ),
    *(['--ros-args', '-p', f'pins:={x}'] for x in ('[]', '[0]', '["99,0"]', '"0,0"', '[' * 2000)),
    *(['--ros-args', '-p', f'pins:=["{"9" * n},0"]'] for n in (30, 300, 5000)),
    *(
        ['--ros-args', '-p', f'{_QOS}.depth:={x}']
        for x in ('-1', 'junk', '1e3', '2000000000', '9' * 18)
    ),
    *(['--ros-args', '-p', f'{_QOS}.reliability:={x}'] for x in ('junk', '1', '""', '[a]')),
    *(['--ros-args', '-p', f'{_QOS}.history:={x}'] for x in ('junk', 'true')),
    *(
        ['--ros-args', '-p', f'frame_id:={x}']
        for x in ('x' * 100_000, '\udcff', '3', '"\\n"', '[a]')
    ),
    *(
        ['--ros-args', '-r', rule]
        for rule in ('__node:=a b', '__ns:=//', 'wind:=a b', '__node:=', ':=')
    ),
    *(['--ros-args', '--log-level', x] for x in ('junk', 'a:=b:=c', '')),
    *(['--ros-args', '-e', 'a b'], ['--ros-args', '--log-config-file', 'none']),
    *(
        ['--ros-args', '-p', 'solver.substeps:=3'],
        ['--ros-args', '-p', 'wind.gust.speed:=[5.0,1.0]'],
    ),
    *(
        ['--ros-args', '--params-file', x]
        for x in ('none.yaml', '/tmp', '/dev/zero', '/dev/stdin', '')
    ),
]


def complaint(status: int | None, output: str, command: str) -> str:
    """Say what is wrong with how a command ended; nothing, if it is exit code 2 and one line."""
    lines = output.splitlines()
    # rcl writes what it has to say to its log as well; that is its own line.
    own = [
        line
        for line in lines
        if not any(word in line for word in ('] [rcl', '[rcutils', '[INFO]'))
    ]
    if status != 2:
        return f'exit code {status}: {output[-300:]}'
    if 'Traceback' in output or len(own) != 1 or not own[0].startswith(f'{command}: '):
        return f'not one line: {output[-600:]}'
    if len(own[0]) > _LONGEST or not own[0].isprintable():
        return f'not clear: {own[0][:300]}'
    return ''


def try_node(tally: Tally, domain: int, arguments: Sequence[str]) -> None:
    """Start the node with arguments; it must run, and end when asked, or refuse them."""
    process = Process([*NODE, *arguments], {**environment(domain), 'PYTHONUNBUFFERED': '1'})
    end = time.monotonic() + _PATIENCE
    while process.alive and _RUNNING not in process.output and time.monotonic() < end:
        time.sleep(0.02)
    runs = process.alive and _RUNNING in process.output
    status = process.stop(signal.SIGINT if runs else signal.SIGKILL, _PATIENCE)
    wrong = '' if runs and status == 0 else complaint(status, process.output, 'cloth_node')
    if wrong:
        tally.blame(wrong, arguments)
    elif runs:
        tally.accepted += 1
    else:
        tally.refused += 1


def node_arguments(folder: Path, cases: int) -> Iterator[list[str]]:
    """Yield arguments of the node, no two alike: the ones above, and bad and damaged files."""
    os.mkfifo(folder / 'pipe')
    many = [*NODE_ARGUMENTS, ['--ros-args', '--params-file', str(folder / 'pipe')]]
    generator = np.random.default_rng(0)
    generator.shuffle(many)
    yield from many[:cases]
    path = folder / 'scene.yaml'
    files, seen = whole(), set()
    while len(seen) < cases - len(many):
        either = files[generator.integers(len(files))], damaged(generator)
        content = either[len(seen) % 2]
        if content not in seen:
            seen.add(content)
            path.write_bytes(content)
            yield ['--ros-args', '--params-file', str(path)]


def node(cases: int) -> Tally:
    """Start the node with bad command lines."""
    what = 'command lines of cloth_node, no two alike'
    tally = Tally(what, 'exit code 2 and one line, or it runs')
    with tempfile.TemporaryDirectory() as folder, free_domain() as domain:
        for arguments in node_arguments(Path(folder), cases):
            try_node(tally, domain, arguments)
    return tally


def _study_arguments(folder: Path, generator: np.random.Generator) -> list[str]:
    """Return arguments of the study that cannot be valid, so that it does not begin."""
    good, bad = folder / 'good.yaml', folder / 'bad.yaml'
    good.write_bytes(READY[0])
    bad.write_bytes(b'/**: {ros__parameters: {rate: -1}}')
    full = folder / 'full.yaml'
    full.write_bytes(b'/**: {ros__parameters: {pins: [":,:"]}}')
    soft = folder / 'soft.yaml'
    zero = b'springs: {structural: 0, shear: 0, bending: 0}'
    soft.write_bytes(b'/**: {ros__parameters: {' + zero + b'}}')
    word = bytes(generator.integers(ord('a'), ord('z') + 1, 4).tolist()).decode()
    numbers = ['', 'nan', 'inf', '-inf', '0', '1e400', '1e-999', '\udcff', '--']
    numbers += [word, f'{generator.uniform(61, 1e6)}', f'{generator.uniform(-1e6, 0)}'] * 3
    number = numbers[generator.integers(len(numbers))]
    wrong: list[list[str]] = [
        *(
            [str(path)]
            for path in (bad, full, soft, folder, '/dev/zero', word, '', '\0', '\udcff')
        ),
        *([], ['--foo'], ['-q'], ['--quick=3'], ['--sphere', '1'], ['--out'], ['--', '--out']),
        *([str(good), flag, number] for flag in ('--seconds', '--over')),
        [str(good), '--sphere', word, '0', number],
        *([str(good), '--out', out] for out in (str(good), f'/proc/{word}', '\0', '/dev/null/x')),
        [str(good), str(good)],
    ]
    # Before what is wrong, which thereby comes last and counts.
    right = [['--quick'], ['--fresh'], ['--seconds', '0.5'], ['--over', '0.2']]
    right += [['--sphere', '0', '0', '1'], ['--out', str(folder / 'out')]]
    chosen = generator.permutation(len(right))[: generator.integers(4)]
    arguments = [each for place in chosen for each in right[place]]
    return arguments + wrong[generator.integers(len(wrong))]


def study(cases: int) -> Tally:
    """Call the command `cloth_tradeoff` with bad command lines, in this process."""
    what = 'command lines of cloth_tradeoff, no two alike'
    tally = Tally(what, 'exit code 2 and one line')
    generator = np.random.default_rng(0)
    seen: set[tuple[str, ...]] = set()
    with tempfile.TemporaryDirectory() as folder:
        while len(seen) < cases:
            arguments = _study_arguments(Path(folder), generator)
            if tuple(arguments) in seen:
                continue
            seen.add(tuple(arguments))
            output = io.StringIO()
            try:
                with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
                    status = tradeoff(arguments)
            except SystemExit as ending:
                status = ending.code
            except Exception as error:
                status = f'{type(error).__name__}: {error}'
            # As the standard error stream writes it.
            text = output.getvalue().encode('utf-8', 'backslashreplace').decode()
            wrong = complaint(status, text, 'cloth_tradeoff')
            if wrong:
                tally.blame(wrong, arguments)
            else:
                tally.refused += 1
    return tally


def study_process(arguments: Sequence[str]) -> tuple[int, str]:
    """Run the command `cloth_tradeoff` as a process; return exit code and output."""
    command = [sys.executable, '-m', 'cloth_ros.tradeoff.main', *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, timeout=_PATIENCE, check=False)
    return done.returncode, (done.stdout + done.stderr).decode(errors='backslashreplace')
