"""Repeat a recording, or simulate it again, and report."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .bag import Bag
from .comparison import Comparison
from .estimate_check import EstimateCheck, find_windows
from .recorded_cloth import RecordedCloth
from .resimulation import Resimulation, Settings
from .timeline import Step, timeline

Progress = Callable[[int, int], None]  # ticks done, and of how many; 0: unknown


@dataclass(frozen=True)
class Outcome:
    """
    What became of a bag.

    Attributes
    ----------
    lines
        For people.
    identical
        False if a recorded state was repeated with other bits, or none could be compared.
    result
        Numbers by name.

    """

    lines: list[str]
    identical: bool
    result: dict[str, Any]


def repeat(path: Path, node: str | None, progress: Progress) -> Outcome:
    """
    Repeat the ticks of a recording, and compare with the recorded states.

    Parameters
    ----------
    path
        Of the bag.
    node
        Full name of the recorded node; None: the only one.
    progress
        Called after each tick.

    Raises
    ------
    ValueError
        The bag cannot be read, or has no record of ticks.

    """
    bag = Bag(path)
    comparison = Comparison()
    stopped = not _run(bag, RecordedCloth(bag, node), comparison, progress)
    result: dict[str, Any] = {
        'bag': str(path),
        'ticks': comparison.ticks,
        'states': comparison.states,
        'differing states': comparison.differing,
        'keyframes': comparison.keyframes,
        'differing keyframes': comparison.differing_keyframes,
        'largest distance [m]': comparison.largest,
        'first difference': comparison.first,
        'states not recorded': comparison.unrecorded,
        'gaps': comparison.gaps,
        'defects': bag.defects,
    }
    complete = comparison.identical and not stopped
    return Outcome([*comparison.lines(), *bag.defects], complete, result)


def resimulate(
    path: Path, node: str | None, settings: Settings, folder: Path, progress: Progress
) -> Outcome:
    """
    Simulate a recording again, and write the new bag and the error of the recorded run.

    Parameters
    ----------
    path, node, progress
        See `repeat`.
    settings
        How to simulate.
    folder
        Where to write, which is made; it must not have a ``bag`` yet.

    Raises
    ------
    ValueError
        The bag cannot be read, or has no record of ticks; the settings are not valid; or the
        folder cannot be written to.

    """
    from .plot import draw

    bag = Bag(path)
    recorded = RecordedCloth(bag, node)
    if (folder / 'bag').exists():
        raise ValueError(f'{folder / "bag"} exists already; give another folder with --out')
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f'--out {folder}: {error.strerror}; give a folder to write to') from None
    run = Resimulation(settings, folder, recorded)
    try:
        _run(bag, recorded, run, progress)
    finally:
        run.close()
    result = {
        'bag': str(path),
        'changed parameters': dict(settings.parameters),
        'grid refinement': settings.refinement,
        **run.history.summary(),
        'gaps': run.gaps,
        'defects': bag.defects,
    }
    (folder / 'error.json').write_text(json.dumps(result, indent=1) + '\n')
    draw(run, f'{path.name}: error of the recorded run', folder / 'error.png')
    return Outcome([*_table(run), *run.gaps, *bag.defects], True, result)


def check_estimates(
    path: Path, node: str | None, settings: Settings, progress: Progress
) -> Outcome:
    """
    Compare the live error estimates in a recording with the error that a finer run finds.

    See `resimulate` for the parameters and errors; without changed parameters, the finer run has
    double precision and a hundredth of the tolerance.
    """
    bag = Bag(path)
    recorded = RecordedCloth(bag, node)
    check = EstimateCheck(find_windows(recorded), settings)
    _run(bag, recorded, check, progress)
    result = {
        'bag': str(path),
        'estimates': [{**each.estimate._asdict(), 'found': each.found} for each in check.checked],
        'estimate by error found, median': check.ratio,
        'gaps': check.gaps,
        'defects': bag.defects,
    }
    return Outcome([*check.lines(), *bag.defects], True, result)


def _run(
    bag: Bag,
    recorded: RecordedCloth,
    taker: Comparison | Resimulation | EstimateCheck,
    progress: Progress,
) -> bool:
    """Take all entries of the timeline; return False if that had to stop before the end."""
    ticks = 0
    for entry in timeline(recorded):
        try:
            taker.take(entry)
        except ValueError as error:
            if ticks == 0:
                raise
            bag.note(f'stopped after {ticks} ticks: {error}')
            return False
        if isinstance(entry, Step):
            ticks += 1
            progress(ticks, recorded.ticks)
    if ticks == 0:
        defects = ''.join(f'; {defect}' for defect in bag.defects)
        raise ValueError(
            f'{bag.path} has no tick behind a keyframe, so nothing can be repeated; record '
            f'{recorded.topic("keyframes")} as well{defects}'
        )
    return True


def _table(run: Resimulation) -> list[str]:
    """Return the error over time in some lines."""
    entries = run.history.entries
    chosen = [entries[len(entries) * part // 8 - 1] for part in range(1, 9) if len(entries) >= 8]
    lines = ['simulated for [s]   largest error [mm]   rms error [mm]']
    lines += [
        f'{entry.time:17.2f}   {1e3 * entry.largest:18.4g}   {1e3 * entry.rms:14.4g}'
        for entry in chosen or entries
    ]
    return lines
