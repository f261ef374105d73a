"""Recommendation of settings from the measurements of a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

# Share of real time that the simulation may take: messages, services and other programs need the
# rest.
SHARE = 0.6
# Position error, m, within which the cheapest setting is recommended.
ACCURACY = 1e-4

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

    Fixed numbers serve for comparison only: they are not increased where the cloth moves fast.
    Of tolerances that lead to the same substeps the smallest is returned.
    """
    found: dict[tuple[object, ...], Entry] = {}
    for entry in sorted(candidates(result), key=lambda each: each['setting']['tolerance']):
        setting = entry['setting']
        steps = round(entry['substeps per tick'], 3)
        if not setting['substeps']:
            found.setdefault((setting['method'], setting['precision'], steps), entry)
    return list(found.values())


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


def for_real_time(result: Entry) -> Entry | None:
    """Return the most accurate setting within `SHARE` of real time; None if there is none."""
    affordable = [entry for entry in usable(result) if cost(entry) <= SHARE]
    return min(affordable, key=error, default=None)


def for_accuracy(result: Entry) -> Entry | None:
    """Return the cheapest setting whose error is at most `ACCURACY`; None if there is none."""
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
