"""
Picture of the browser view for the README, from the real page.

    python -m tools.viewer_picture docs/pictures/viewer.png
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from chromium import MISSING, View, address_of, browsing, chromium
from ros import NODE, Process, environment, free_domain

_SCENE = 'config/gust.yaml'
_VIEWER = (sys.executable, '-m', 'cloth_ros.viewer.main', '--port', '0')
_SPHERE = '/cloths/cloth/colliders/sphere'


def main() -> None:
    """Start a node and the viewer, drag the sphere into the curtain, and save the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').strip().splitlines()[0])
    parser.add_argument('path', type=Path)
    path = parser.parse_args().path.resolve()
    if chromium() is None:
        raise SystemExit(MISSING)
    with free_domain() as domain, browsing() as browser:
        processes = [
            Process((*NODE, '--ros-args', '--params-file', _SCENE), environment(domain)),
            Process(_VIEWER, environment(domain)),
        ]
        try:
            processes[1].wait_for_output('in a browser')
            view = View(browser, address_of(processes[1].output))
            view.wait_for_node(_SPHERE)
            view.page.get_by_role('alert').get_by_role('button').first.click()
            view.slide('speed, m/s', 0.12)
            view.slide('direction, °', 0.25)  # against the sphere
            view.page.wait_for_timeout(30_000)  # for the plots
            view.drag_collider(_SPHERE, [0.0, 0.13, 0.0], [0.0, 0.7, 0.0])
            view.page.wait_for_timeout(1500)
            view.page.screenshot(path=path)
        finally:
            for process in processes:
                process.end()


if __name__ == '__main__':
    main()
