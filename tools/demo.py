"""
Start the node on a scene and the browser view of it; Ctrl-C ends both.

    python -m tools.demo SCENE

The environment variable PORT is the port of the page.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

_POLL = 0.1  # s, from one check of the processes to the next
_PATIENCE = 10.0  # s, from the signal until a process that has not ended is killed
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_NODE, _VIEWER = (f'{sys.prefix}/bin/{name}' for name in ('cloth_node', 'cloth_viewer'))


def end(processes: list[subprocess.Popen[bytes]]) -> None:
    """End processes as Ctrl-C does; what has not ended after some seconds is killed, and named."""
    for process in processes:
        process.send_signal(signal.SIGINT)  # not to one that has ended
    last = time.monotonic() + _PATIENCE
    for process in processes:
        try:
            process.wait(max(last - time.monotonic(), 0.0))
        except subprocess.TimeoutExpired:
            print(f'{process.args!r} did not end in {_PATIENCE:g} s: killed', file=sys.stderr)
            process.kill()
            process.wait()


def run(scene: str) -> int:
    """Run node and viewer until one ends or a signal comes; return the exit code."""
    signals: list[int] = []
    for number in _SIGNALS:
        signal.signal(number, lambda received, _: signals.append(received))
    port = ['--port', os.environ['PORT']] if os.environ.get('PORT') else []
    commands = [
        [_NODE, '--ros-args', '--params-file', scene],
        # The cloth comes first where both want the processor.
        ['nice', '-n', '5', _VIEWER, *port],
    ]
    # In groups of their own: Ctrl-C reaches this program alone, which ends both.
    processes = [subprocess.Popen(command, preexec_fn=os.setpgrp) for command in commands]
    # Neither is of use without the other.
    while not signals and all(process.poll() is None for process in processes):
        time.sleep(_POLL)
    codes = [process.returncode for process in processes if process.returncode is not None]
    end(processes)
    return 0 if signals else codes[0]


def main() -> int:
    """Check the scene file, and run."""
    (scene,) = sys.argv[1:]
    if not Path(scene).is_file():
        ready = ' '.join(sorted(map(str, Path('config').glob('*.yaml'))))
        print(f"cloth_ros: there is no scene '{scene}'; ready ones are: {ready}", file=sys.stderr)
        return 1
    return run(scene)


if __name__ == '__main__':
    sys.exit(main())
