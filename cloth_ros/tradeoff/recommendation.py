"""
Recommendation of settings from the measurements of a study: functions of its result alone.

The error of a simulation is that of the grid, and that of the time step and of the precision on
it.  The two are independent, so that a setting is judged by the root of the sum of their squares:
where the grid is far off, a finer time step or double precision gains nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

# Share of real time that the simulation may take: messages, services and other programs need the
# rest.
SHARE = 0.6
# Position error, m, on the same grid, for which the cheapest setting is looked up.
ACCURACY = 1e-4
# Factor between the total errors of two settings that is worth a higher cost.
WORTH = 1.1

Entry = dict[str, Any]


def candidates(result: Entry) -> list[Entry]:
    """Return the settings that are stable, valid in a scene, and whose error is known."""
    return [
        entry
        for entry in result['settings']
        if entry['error'] is not None and not entry['refused']
    ]


def usable(result: Entry) -> list[Entry]:
    """
    Return the candidates in which the solver chooses the number of substeps.

    Fixed numbers, and substeps that do not follow the state, serve for comparison only: the former
    are not increased where the cloth moves fast.
    Of those that lead to the same substeps and the same error, to the last bit, one is returned:
    that of the smallest tolerance, and `single` where that is simulated in double precision too.
    """
    found: dict[tuple[object, ...], Entry] = {}
    for entry in sorted(candidates(result), key=_promise):
        setting = entry['setting']
        steps = round(entry['substeps per tick'], 3)
        if not setting['substeps'] and follows_state(entry):
            found.setdefault((setting['method'], steps, error(entry)), entry)
    return list(found.values())


def follows_state(entry: Entry) -> bool:
    """Return whether the substeps of a setting follow the state of the cloth."""
    return bool(entry['setting'].get('follows_state', True))  # as in older results


def without_following(entry: Entry, result: Entry) -> Entry | None:
    """Return the setting that differs only in that its substeps do not follow the state."""
    wanted = {**entry['setting'], 'follows_state': False}
    return next((each for each in result['settings'] if each['setting'] == wanted), None)


def _promise(entry: Entry) -> tuple[float, bool]:
    return entry['setting']['tolerance'], entry['setting']['precision'] != 'single'


def frontier(entries: Sequence[Entry]) -> list[Entry]:
    """Return the settings that no other one beats in both cost and error, sorted by cost."""
    best: list[Entry] = []
    for entry in sorted(entries, key=lambda each: (cost(each), error(each))):
        if not best or error(entry) < error(best[-1]):
            best.append(entry)
    return best


def cost(entry: Entry) -> float:
    """Return the wall-clock time per simulated second, s."""
    return float(entry['wall']['median'])


def error(entry: Entry) -> float:
    """Return the largest position error, m."""
    return float(entry['error']['largest'])


@dataclass(frozen=True)
class GridError:
    """
    Error of the scene's grid, as far as it was measured.

    Attributes
    ----------
    distance
        Largest distance, m, of the solution on the scene's grid from that on another one.
    other
        The other grid: the finest one, or, if that is the scene's own, the next coarser one, from
        which a solution that converges in first order is as far as from the exact one.
    finer
        True if the other grid is finer: the error is then at least about the distance.

    """

    distance: float
    other: Entry
    finer: bool


def _grids(result: Entry) -> tuple[list[Entry], Entry | None, list[Entry]]:
    """Return the coarser grids, that of the scene, and the finer grids, each by its spacing."""
    sides = (result['parameters']['sheet.rows'], result['parameters']['sheet.columns'])
    grids = sorted(result['grids'], key=lambda entry: entry['rows'] * entry['columns'])
    for n, entry in enumerate(grids):
        if (entry['rows'], entry['columns']) == sides:
            return grids[:n], entry, grids[n + 1 :]
    return [], None, []


def grid_error(result: Entry) -> GridError | None:
    """Return the error of the scene's grid; None if no other grid was measured."""
    coarser, own, finer = _grids(result)
    if own is not None and finer:
        return GridError(float(own['largest']), finer[-1], True)
    if own is not None and coarser:
        return GridError(float(coarser[-1]['largest']), coarser[-1], False)
    return None


def finer_grids(result: Entry) -> list[Entry]:
    """Return the grids that are finer than that of the scene, by their spacing."""
    return _grids(result)[2]


def finer_grid(result: Entry) -> Entry | None:
    """
    Return the finest grid within `SHARE` of real time; None if that is no improvement.

    It has to be finer than that of the scene, and it and those between have to be nearer to the
    finest grid.
    """
    _, own, finer = _grids(result)
    best = None
    for each in finer:
        if own is None or cost(each) > SHARE or each['largest'] * WORTH >= own['largest']:
            break
        best = each
    return best


def coarser_grid(result: Entry) -> Entry | None:
    """Return the finest grid that is coarser than that of the scene and within `SHARE`."""
    coarser, _, _ = _grids(result)
    affordable = [each for each in coarser if cost(each) <= SHARE]
    return affordable[-1] if affordable else None


@dataclass(frozen=True)
class Choice:
    """
    The recommended setting, and the settings that explain why it is none of the others.

    Attributes
    ----------
    setting
        The cheapest one within `SHARE` of real time whose total error is the smallest, or so near
        it that the difference is not worth the cost; None if no setting is within `SHARE`.
    grid
        Error of the grid; None if it is not known, and then taken as zero.
    cheaper
        Of the cheaper settings, the most accurate one; its total error is larger.
    gainless
        Of the more accurate settings within `SHARE`, the cheapest one: it gains nothing.
    slower
        Of the settings beyond `SHARE`, the cheapest one whose total error is smaller.

    """

    setting: Entry | None
    grid: GridError | None
    cheaper: Entry | None
    gainless: Entry | None
    slower: Entry | None

    @property
    def grid_dominates(self) -> bool:
        """True if the error of the grid is larger than that of the recommended setting."""
        if self.setting is None or self.grid is None:
            return False
        return self.grid.distance > error(self.setting)


def choose(result: Entry) -> Choice:
    """Return the recommended setting of a scene for real time on its grid."""
    known, grid = usable(result), grid_error(result)

    def total(entry: Entry) -> float:
        return math.hypot(error(entry), grid.distance if grid else 0.0)

    def cheapest(entries: list[Entry]) -> Entry | None:
        return min(entries, key=lambda each: (cost(each), error(each)), default=None)

    affordable = [each for each in known if cost(each) <= SHARE]
    beyond = [each for each in known if cost(each) > SHARE]
    least = min(map(total, affordable), default=0.0)
    setting = cheapest([each for each in affordable if total(each) <= WORTH * least])
    if setting is None:
        return Choice(None, grid, None, None, cheapest(beyond))
    return Choice(
        setting,
        grid,
        min((each for each in known if cost(each) < cost(setting)), key=error, default=None),
        cheapest([each for each in affordable if error(each) < error(setting)]),
        cheapest([each for each in beyond if WORTH * total(each) < total(setting)]),
    )


def for_accuracy(result: Entry) -> Entry | None:
    """
    Return the cheapest setting whose error on the grid is at most `ACCURACY`; None if none is.

    It may be slower than real time.
    """
    accurate = [entry for entry in usable(result) if error(entry) <= ACCURACY]
    return min(accurate, key=cost, default=None)


def parameters(entry: Entry) -> str:
    """Return the parameters of a setting as YAML for a scene file."""
    setting = entry['setting']
    # Without an exponent: YAML 1.1 reads 1e-05 as a string.
    tolerance = f'{setting["tolerance"]:.7f}'.rstrip('0')
    return (
        f'solver: {{method: {setting["method"]}, precision: {setting["precision"]}, '
        f'tolerance: {tolerance}}}'
    )
