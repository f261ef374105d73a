"""Tables of contact in the report of `make bench`: cost by shape, and drops in other engines."""

from __future__ import annotations

from typing import Any

from cloth_ros.tradeoff.formatting import table

Entry = dict[str, Any]

_SUPPORTS = {'table': 'On a table', 'box': 'On a box'}


def contact_table(entries: list[Entry]) -> str:
    """
    Return the cost of a substep in contact, as a ratio to that of the hanging sheet.

    Parameters
    ----------
    entries
        Results of `test_contact`.  Those of a size and number of threads without a hanging sheet
        are left out.

    """
    cost = {
        (entry['state'], entry['size'], entry['threads']): 1e9 * entry['median'] / entry['steps']
        for entry in entries
    }
    columns = sorted((size, threads) for state, size, threads in cost if state == 'hanging')
    rows = []
    for state in dict.fromkeys(entry['state'] for entry in entries):
        row = ['hanging, ns' if state == 'hanging' else state.replace(' ', ' on ')]
        for column in columns:
            value = cost.get((state, *column))
            if value is None:
                row.append('')
            elif state == 'hanging':
                row.append(f'{value:.2f}')
            else:
                row.append(f'{value / cost[("hanging", *column)]:.2f}')
        rows.append(row)
    head = [f'{size}², {count} thread' + 's' * (count > 1) for size, count in columns]
    return table(['sheet', *head], rows)


def contact_section(entries: list[Entry]) -> list[str]:
    """Return the lines of the section on contact in this package."""
    return [
        '## Cost of contact',
        '',
        'Single precision. The first row is the cost of a sheet that hangs from two corners, in '
        'nanoseconds per particle and substep; the others are ratios to it, of the same free '
        'sheet that lies on a collider, and in the tick in which it falls on it flat, with 1 m/s. '
        'The sphere has a radius of 0.3 m, the box edges of 0.4 m; the capsule, 0.15 m in radius, '
        'lies, the cylinder, 0.2 m in radius, stands; the mesh is a torus of 2,304 triangles.',
        '',
        contact_table(entries),
        '',
    ]


def drop_table(entries: list[Entry], support: str) -> str:
    """Return the table of drops on one support, sorted by size and time."""
    entries = [entry for entry in entries if entry['support'] == support]
    own = {
        entry['size']: entry['median']
        for entry in entries
        if entry['engine'] == 'cloth_ros' and entry['held']
    }
    rows = []
    for entry in sorted(entries, key=lambda e: (e['size'], not e['held'], e['median'])):
        size, median = entry['size'], entry['median']
        if entry['held']:
            measured = [
                f'{1 / 60 / median:.3g}',
                f'{median / own[size]:.3g}' if size in own else '',
                *(f'{1e3 * entry[name]:.1f}' for name in ('depth', 'deepest')),
                *(f'{entry[name]:.2f}' for name in ('stretch', 'speed')),
            ]
        else:
            measured = ['fell through or flew apart', *[''] * 5]
        rows.append([f'{size} × {size}', entry['engine'], *measured, entry['settings']])
    head = ['sheet', 'engine', 'real-time factor', 'time / ours']
    head += ['depth [mm]', 'largest depth [mm]', 'stretch', 'speed [m/s]', 'settings']
    return table(head, rows)


def drop_section(entries: list[Entry]) -> list[str]:
    """Return the lines of the section on drops in this package and other engines."""
    lines = [
        '## Contact in other engines',
        '',
        'The sheet of the comparison above, free, falls flat from 0.05 m on a table, or on a box '
        'of 0.4 m, over whose edges it drapes; the coefficient of friction is 0.3. The real-time '
        'factor is that of ticks from 1.5 s to 2 s. The depth is that of the triangles, sampled '
        'densely, in the true table or box, by the same function for every engine: at 2 s, and '
        'the largest after any tick. Stretch and speed are the largest at 2 s; without damping, '
        'a sheet on the box still moves then. Each engine has the fastest setting found that '
        'stays stable, is no deeper than 5 mm at the end, and stretches by no more than 0.2.',
        '',
        'The models differ. PyBullet and the Taichi program keep the particles off, and Newton '
        'does so here, where contacts of whole triangles took longer: edges of the box enter '
        'between particles unless these keep half a spacing away. MuJoCo keeps triangles off. The '
        'thickness, in the settings, is therefore part of the result: a sheet does not lie '
        'closer than that. MuJoCo, Newton and PyBullet have elasticity of their own, and steps '
        'of different numerical dissipation. There is no air or drag here.',
        '',
    ]
    for support, title in _SUPPORTS.items():
        if any(entry['support'] == support for entry in entries):
            lines += [f'{title}:', '', drop_table(entries, support), '']
    return lines
