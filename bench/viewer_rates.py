"""
Frames per second of the browser view, and what it costs the node.

    python -m bench.viewer_rates [--sizes 32 64 128] [--seconds 20]

For each size a node is started, and measured alone, with the viewer, and with the viewer and a
page that shows it in a headless Chromium.  That one has no graphics processor: it draws on the
same cores on which node and viewer run, and its frames per second are a lower bound.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from pathlib import Path
from typing import NamedTuple

from cloth_ros.tradeoff.machine import describe

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from chromium import MISSING, View, address_of, browsing, chromium
from ros import NODE, Listener, Process, environment, free_domain, probing

_VIEWER = ('nice', '-n', '5', sys.executable, '-m', 'cloth_ros.viewer.main', '--port', '0')
_UPPER = '/cloths/cloth/sheet/upper'
_SETTLE = 4.0  # s, after everything has started
# Frames that were drawn, states of the sheet that these showed, and the time in ms.
_COUNTS = """name => {
    let version = 0;
    window.__viserMutable.nodeRefFromName[name].traverse(each => {
        if (each.isMesh) version = Math.max(version, each.geometry.attributes.position.version);
    });
    return [window.__viserTestpoints.rendererInfo.render.frame, version, performance.now()];
}"""


class Cost(NamedTuple):
    """Of one period: simulated time by time, and processor time of node and viewer by time."""

    factor: float
    node: float
    viewer: float


def measure(
    listener: Listener, seconds: float, node: Process, viewer: Process | None = None
) -> Cost:
    """Measure for some seconds."""
    listener.spin_for(_SETTLE)
    first, used = listener.next_report(), [each.cpu_seconds for each in (node, viewer) if each]
    start = time.monotonic()
    listener.spin_for(seconds)
    last, passed = listener.next_report(), time.monotonic() - start
    factor = (last.simulated - first.simulated) / (last.at - first.at)
    now = [each.cpu_seconds for each in (node, viewer) if each]
    shares = [(after - before) / passed for before, after in zip(used, now, strict=True)]
    return Cost(factor, shares[0], shares[1] if viewer else 0.0)


def measure_size(size: int, seconds: float, renderer: tuple[str, ...]) -> str:
    """Return a row of the table."""
    parameters = {'sheet.rows': size, 'sheet.columns': size}
    command = [*NODE, '--ros-args']
    for name, value in parameters.items():
        command += ['-p', f'{name}:={value}']
    with free_domain() as domain, probing(domain, Listener) as listener:
        node = Process(command, environment(domain))
        viewer = None
        try:
            listener.spin_until(lambda: listener.reports and listener.reports[-1].factor > 0.5)
            alone = measure(listener, seconds, node)
            viewer = Process(_VIEWER, environment(domain))
            viewer.wait_for_output('showing')
            unwatched = measure(listener, seconds, node, viewer)
            with browsing(*renderer) as browser:
                view = View(browser, address_of(viewer.output))
                view.wait_for_node(_UPPER)
                view.page.wait_for_timeout(1e3 * _SETTLE)
                before = view.page.evaluate(_COUNTS, _UPPER)
                watched = measure(listener, seconds, node, viewer)
                after = view.page.evaluate(_COUNTS, _UPPER)
        finally:
            node.end()
            if viewer is not None:
                viewer.end()
    frames, states, passed = (b - a for a, b in zip(before, after, strict=True))
    return (
        f'| {size} × {size} | {alone.factor:.3f} | {unwatched.factor:.3f} | {watched.factor:.3f} '
        f'| {1e3 * frames / passed:.1f} | {1e3 * states / passed:.1f} '
        f'| {2 * 12 * size**2 / 1e3:.0f} | {100 * watched.viewer:.0f} |'
    )


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').strip().splitlines()[0])
    parser.add_argument('--sizes', type=int, nargs='+', default=[32, 64, 128])
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument(
        '--renderer', default='', help='flags of Chromium (default: SwiftShader, without GPU)'
    )
    arguments = parser.parse_args()
    if chromium() is None:
        raise SystemExit(MISSING)
    print(', '.join(f'{name} {value}' for name, value in describe().items()))
    print(
        '| sheet | real-time factor of the node alone | with the viewer | with viewer and page '
        '| frames per second | states shown per second | kB per state '
        '| viewer, % of a core |\n' + '| --- ' * 8 + '|'
    )
    for size in arguments.sizes:
        renderer = tuple(re.split(r'\s+', arguments.renderer)) if arguments.renderer else ()
        print(measure_size(size, arguments.seconds, renderer), flush=True)


if __name__ == '__main__':
    main()
