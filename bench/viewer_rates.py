"""
Frames per second of the browser view, and what it costs the node.

    python -m bench.viewer_rates [--sizes 32 64 128] [--seconds 20] [--renderer mesa]
                                 [--no-shadows] [--page FILE]

For each size a node is started, and measured alone, with the viewer, and with the viewer and a
page that shows it in a headless Chromium.  That one has no graphics processor: it draws on the
same cores on which node and viewer run, and its frames per second are a lower bound.  States that
reach the page, and its own work, are counted apart from drawing: they show which of both is the
limit.  With `--page`, usually docs/viewer.md, the table is written there, too.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from cloth_ros.tradeoff.machine import describe_in_a_line
from tools.marked_block import fill

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from chromium import MISSING, RENDERERS, View, address_of, browsing, chromium
from ros import NODE, Listener, Process, environment, free_domain, probing

_VIEWER = ('nice', '-n', '5', sys.executable, '-m', 'cloth_ros.viewer.main', '--port', '0')
_UPPER = '/cloths/cloth/sheet/upper'
# Kinds of processes: the page itself, and what draws it.
_WORK = ('renderer', 'gpu-process')
_SETTLE = 4.0  # s, after everything has started
# Counts batches of messages with positions that the page's socket passes on.
_COUNT_RECEIVED = """(() => {
    const Plain = window.Worker;
    window.received = 0;
    window.Worker = class extends Plain {
        constructor(...all) {
            super(...all);
            this.addEventListener('message', event => {
                const messages = event.data.type === 'message_batch' ? event.data.messages : [];
                window.received += messages.some(each => each.updates && each.updates.vertices);
            });
        }
    };
})();"""
# States received, states of the sheet that were shown, frames drawn, and the time in ms.
_COUNTS = """name => {
    let version = 0;
    window.__viserMutable.nodeRefFromName[name].traverse(each => {
        if (each.isMesh) version = Math.max(version, each.geometry.attributes.position.version);
    });
    const frame = window.__viserTestpoints.rendererInfo.render.frame;
    return [window.received, version, frame, performance.now()];
}"""


class Cost(NamedTuple):
    """
    Of one period.

    Attributes
    ----------
    factor
        Simulated time by time.
    viewer
        Processor time of the viewer by time.

    """

    factor: float
    viewer: float


def browser_seconds(kind: str) -> float:
    """Return the processor time of Chromium's processes of a kind in this process tree, s."""
    parents: dict[int, int] = {}
    times: dict[int, float] = {}
    for folder in Path('/proc').glob('[0-9]*'):
        with suppress(OSError):  # it has ended
            fields = (folder / 'stat').read_text().rpartition(')')[2].split()
            parents[int(folder.name)] = int(fields[1])
            if f'--type={kind}' in (folder / 'cmdline').read_text():
                ticks = int(fields[11]) + int(fields[12])
                times[int(folder.name)] = ticks / os.sysconf('SC_CLK_TCK')

    def is_ours(pid: int) -> bool:
        return pid == os.getpid() or (pid > 1 and is_ours(parents.get(pid, 0)))

    return sum(seconds for pid, seconds in times.items() if is_ours(pid))


def measure(listener: Listener, seconds: float, viewer: Process | None = None) -> Cost:
    """Measure for some seconds."""
    listener.spin_for(_SETTLE)
    first = listener.next_report()
    start, used = time.monotonic(), viewer.cpu_seconds if viewer else 0.0
    listener.spin_for(seconds)
    last, passed = listener.next_report(), time.monotonic() - start
    simulated = last.simulated - first.simulated
    factor = simulated / (last.at - first.at)
    used = viewer.cpu_seconds - used if viewer else 0.0
    return Cost(factor, used / passed)


def measure_size(
    size: int, seconds: float, threads: int, renderer: str, *, shadows: bool
) -> tuple[str, str]:
    """Return a row of the table, and what drew the page."""
    parameters = {'sheet.rows': size, 'sheet.columns': size, 'solver.threads': threads}
    command = [*NODE, '--ros-args']
    for name, value in parameters.items():
        command += ['-p', f'{name}:={value}']
    with free_domain() as domain, probing(domain, Listener) as listener:
        node = Process(command, environment(domain))
        viewer = None
        try:
            listener.spin_until(lambda: listener.reports and listener.reports[-1].factor > 0.5)
            alone = measure(listener, seconds)
            viewer = Process(_VIEWER, environment(domain))
            viewer.wait_for_output('showing')
            unwatched = measure(listener, seconds, viewer)
            with browsing(renderer) as browser:
                view = View(browser, address_of(viewer.output))
                view.page.add_init_script(_COUNT_RECEIVED)
                view.page.reload()
                view.wait_for_node(_UPPER)
                if not shadows:
                    view.page.get_by_label('shadows').uncheck()
                view.page.wait_for_timeout(1e3 * _SETTLE)
                before = [*view.page.evaluate(_COUNTS, _UPPER), *map(browser_seconds, _WORK)]
                watched = measure(listener, seconds, viewer)
                after = [*view.page.evaluate(_COUNTS, _UPPER), *map(browser_seconds, _WORK)]
                drawn_by = view.renderer()
        finally:
            node.end()
            if viewer is not None:
                viewer.end()
    received, states, frames, passed, page, drawing = (
        b - a for a, b in zip(before, after, strict=True)
    )
    row = (
        f'| {size} × {size} | {alone.factor:.3f} | {unwatched.factor:.3f} | {watched.factor:.3f} '
        f'| {1e3 * received / passed:.1f} | {1e3 * states / passed:.1f} '
        f'| {1e3 * frames / passed:.1f} | {1e3 * page / max(received, 1):.0f} '
        f'| {1e3 * drawing / max(frames, 1):.0f} | {100 * watched.viewer:.0f} |'
    )
    return row, drawn_by


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').strip().splitlines()[0])
    parser.add_argument('--sizes', type=int, nargs='+', default=[32, 64, 128])
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--threads', type=int, default=1, help='of the node')
    parser.add_argument('--no-shadows', action='store_true', help='leave out the shadows')
    parser.add_argument('--page', type=Path, help='that the table is written to')
    parser.add_argument('--renderer', choices=RENDERERS, default='swiftshader')
    arguments = parser.parse_args()
    if chromium() is None:
        raise SystemExit(MISSING)
    lines = [
        '| sheet | real-time factor of the node alone | with the viewer | with viewer and page '
        '| states received by the page per second | states shown per second | frames per second '
        '| work of the page, ms per state received | drawing, ms per frame '
        '| viewer, % of a core |',
        '| --- ' * 10 + '|',
    ]
    drawn_by = ''
    for size in arguments.sizes:
        row, drawn_by = measure_size(
            size, arguments.seconds, arguments.threads, arguments.renderer,
            shadows=not arguments.no_shadows,
        )  # fmt: skip
        lines.append(row)
        print(row, flush=True)
    machine = describe_in_a_line()
    lines += [
        '',
        f'Threads of the node: {arguments.threads}. Drawn by: {drawn_by}. Measured on: {machine}.',
    ]
    text = '\n'.join(lines)
    print(text)
    if arguments.page is not None:
        fill(arguments.page, 'python -m bench.viewer_rates', text)


if __name__ == '__main__':
    main()
