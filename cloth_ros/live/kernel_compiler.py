"""
Compile kernels in child processes, and load them into this process in the background.

Compiling takes seconds, during which Numba holds the GIL for up to 0.2 s at a time: in a thread of
this process it delayed the ticks.  A child process fills Numba's cache on disk instead; loading
the kernels from there takes some 20 ms.  Where there is no cache, kernels are compiled in a thread
after all.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Collection
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Protocol, TypeVar

from ..scene import Scene
from .compile_kernels import warm_up
from .kernel_cache import KernelNotCached, cache_exists, cached_only, short_switch_interval

T = TypeVar('T')

# Increments of the niceness of child processes: while a cloth runs, and for what is not urgent.
NICE, NICEST = 10, 19
# Most jobs at a time: three kinds at the start, and those of a change meanwhile.
_THREADS = 8
# Between two log messages about one child process, s.
_PROGRESS = 5.0
# A child may miss the cache: two processes that write one index at once lose an entry.
_ATTEMPTS = 2
_ROOT = Path(__file__).parents[2]


class Log(Protocol):
    """Where to report: a `logging.Logger`, or that of a ROS node."""

    def info(self, message: str) -> Any:
        """Report what happens."""

    def warning(self, message: str) -> Any:
        """Report what the user may want to change."""

    def error(self, message: str) -> Any:
        """Report what has failed."""


class KernelCompiler:
    """
    Compile and load kernels while the cloth runs.

    Jobs for the same kinds of kernels run one after the other, as most of what the second needs
    is then in the cache; jobs for different kinds run at once.

    Parameters
    ----------
    log
        Where to report progress.

    """

    def __init__(self, log: Log) -> None:
        self._log = log
        self._executor = ThreadPoolExecutor(_THREADS, thread_name_prefix='kernels')
        self._locks: defaultdict[tuple[str, ...], threading.Lock] = defaultdict(threading.Lock)
        self._children: set[subprocess.Popen[bytes]] = set()
        self._closed = False

    def load(self, scene: Scene, kinds: Collection[str]) -> bool:
        """Load kernels from memory or from the cache; return False if one must be compiled."""
        try:
            with cached_only():
                warm_up(scene, kinds)
        except KernelNotCached:
            return False
        return True

    def submit(self, function: Callable[[], T]) -> Future[T]:
        """Run a function in the background."""
        return self._executor.submit(function)

    def compile(
        self, scene: Scene, kinds: Collection[str], label: str, nice: int = NICE
    ) -> Future[None]:
        """Make kernels available in the background; see `ensure`."""
        return self.submit(lambda: self.ensure(scene, kinds, label, nice))

    def ensure(self, scene: Scene, kinds: Collection[str], label: str, nice: int = NICE) -> None:
        """
        Make kernels available in this process, in the calling thread; takes up to a minute.

        Parameters
        ----------
        scene
            As it is simulated.
        kinds
            Those of `kinds_of` that are wanted.
        label
            What they are, for log messages.
        nice
            Increment of the niceness of the child process.

        """
        with self._locks[tuple(kinds)], short_switch_interval():
            for _ in range(_ATTEMPTS):
                if self.load(scene, kinds):
                    return
                if not (cache_exists() and self._compile_in_child(scene, kinds, label, nice)):
                    break
            self._check_open()
            if not self.load(scene, kinds):
                self._log.info(f'compiling the kernels of {label} in this process')
                warm_up(scene, kinds)

    def _compile_in_child(
        self, scene: Scene, kinds: Collection[str], label: str, nice: int
    ) -> bool:
        """Compile in a child process; return False if that failed or left nothing in the cache."""
        start = time.monotonic()
        job = {'parameters': scene.flat(), 'kinds': list(kinds), 'nice': nice}
        with tempfile.TemporaryFile() as errors:
            try:
                child = self._start(errors)
            except OSError as error:  # no more processes, or no memory for one
                self._log.warning(f'no process to compile the kernels of {label}: {error}')
                return False
            self._log.info(f'compiling the kernels of {label}; they are kept on disk')
            try:
                self._send(child, job)
                while True:
                    with suppress(subprocess.TimeoutExpired):
                        code = child.wait(_PROGRESS)
                        break
                    seconds = time.monotonic() - start
                    self._log.info(f'compiling the kernels of {label}: {seconds:.0f} s so far')
            finally:
                self._end(child)
            self._check_open()
            errors.seek(0)
            text = errors.read().decode(errors='backslashreplace').strip()
        seconds = time.monotonic() - start
        if code != 0:
            self._log.warning(
                f'the process that compiled the kernels of {label} ended with {code} after '
                f'{seconds:.1f} s; they are compiled in this process: {text[-500:]}'
            )
            return False
        self._log.info(f'compiled the kernels of {label} in {seconds:.1f} s')
        for line in text.splitlines():
            self._log.warning(line)
        return not text

    def _start(self, errors: IO[bytes]) -> subprocess.Popen[bytes]:
        # In a session of its own: Ctrl-C in a terminal is for the parent alone.  In the folder of
        # the package, whatever the current one is: the cache belongs to the path of the sources.
        environment = dict(os.environ)
        if folder := environment.get('NUMBA_CACHE_DIR'):
            environment['NUMBA_CACHE_DIR'] = str(Path(folder).absolute())
        child = subprocess.Popen(
            [sys.executable, '-m', f'{__package__}.compile_kernels'],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            env=environment,
            cwd=_ROOT,
            start_new_session=True,
        )
        self._children.add(child)
        if self._closed:
            child.kill()
        return child

    @staticmethod
    def _send(child: subprocess.Popen[bytes], job: dict[str, Any]) -> None:
        assert child.stdin is not None
        with suppress(BrokenPipeError):  # it has ended, and its exit code says so
            child.stdin.write(json.dumps(job).encode() + b'\n')
            child.stdin.flush()

    def _end(self, child: subprocess.Popen[bytes]) -> None:
        child.kill()
        assert child.stdin is not None
        with suppress(BrokenPipeError):
            child.stdin.close()
        child.wait()
        self._children.discard(child)

    def _check_open(self) -> None:
        if self._closed:
            raise CancelledError

    def close(self) -> None:
        """Kill all child processes and give up all jobs."""
        self._closed = True
        for child in list(self._children):
            child.kill()
        self._executor.shutdown(wait=False, cancel_futures=True)
