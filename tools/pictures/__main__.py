"""
Render the scenes for the README.

    python -m tools.pictures [SCENE.yaml …] [--animation] [--out DIRECTORY]

Renders the named scene files and the animation; by default all of config/ and the animation.  Each
scene is run by a node, whose topics are the source of the pictures.  Rendering is off screen and
needs no display.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pyvista
from PIL import Image

from cloth_ros import Scene
from cloth_ros.model import check_scene

from .capture import capture
from .moments import ANIMATION, CONFIG, MOTIONS, Animation, of_scene
from .studio import Studio

_WINDOW, _SUNS, _SKIES = (900, 720), 24, 36
_SMALL_WINDOW, _FEW_SUNS, _FEW_SKIES = (560, 420), 5, 9
_FRAMES_PER_SECOND = 10
_QUALITY = 72  # of the animation, WebP


def _scene(path: Path) -> Scene:
    """Return a scene, or end with one line that says what is wrong with it."""
    if not path.is_file():
        ready = ' '.join(sorted(f'config/{each.name}' for each in CONFIG.glob('*.yaml')))
        raise SystemExit(f"cloth_ros: there is no scene '{path}'; ready ones are: {ready}")
    try:
        scene = Scene.from_yaml(path)
        check_scene(scene)
    except (OSError, ValueError) as error:
        raise SystemExit(f'cloth_ros: {error}') from None
    if min(scene.sheet.rows, scene.sheet.columns) < 2:
        raise SystemExit(
            f'cloth_ros: {path}: a picture needs a sheet of at least 2 × 2 particles, not '
            f'{scene.sheet.rows} × {scene.sheet.columns}'
        )
    return scene


def render_scene(path: Path, folder: Path) -> None:
    """Write the pictures of a scene file."""
    scene, moments = _scene(path), of_scene(path)
    frames = capture(path, [each.seconds for each in moments], MOTIONS.get(path.stem))
    for moment, frame in zip(moments, frames, strict=True):
        (image,) = Studio(scene, moment.view, [frame], _WINDOW).images([frame], _SUNS, _SKIES)
        target = folder / f'{moment.picture}.png'
        Image.fromarray(image).save(target, optimize=True)
        print(target, flush=True)


def render_animation(animation: Animation, folder: Path) -> None:
    """Write an animation, which starts again at its end."""
    path = CONFIG / f'{animation.scene}.yaml'
    seconds = np.arange(animation.begin, animation.end, 1 / _FRAMES_PER_SECOND).tolist()
    frames = capture(path, seconds, MOTIONS.get(animation.scene))
    studio = Studio(_scene(path), animation.view, frames, _SMALL_WINDOW)
    images = [Image.fromarray(image) for image in studio.images(frames, _FEW_SUNS, _FEW_SKIES)]
    target = folder / f'{animation.picture}.webp'
    images[0].save(
        target,
        save_all=True,
        append_images=images[1:],
        duration=round(1000 / _FRAMES_PER_SECOND),
        loop=0,
        quality=_QUALITY,
        method=6,
    )
    print(target)


def main() -> None:
    """Render what the command line names."""
    parser = argparse.ArgumentParser(
        prog='python -m tools.pictures', description='Render scenes from the topics of a node.'
    )
    parser.add_argument('scenes', nargs='*', type=Path, help='default: all, and the animation')
    parser.add_argument('--animation', action='store_true', help='render the animation')
    parser.add_argument('--out', type=Path, default=Path('docs/pictures'), help='folder')
    arguments = parser.parse_args()
    pyvista.vtk_verbosity('off')  # it reports that there is no display
    arguments.out.mkdir(parents=True, exist_ok=True)
    everything = not (arguments.scenes or arguments.animation)
    for path in sorted(CONFIG.glob('*.yaml')) if everything else arguments.scenes:
        render_scene(path, arguments.out)
    if everything or arguments.animation:
        render_animation(ANIMATION, arguments.out)


if __name__ == '__main__':
    main()
