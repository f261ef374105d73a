"""What the page says about cloths, as HTML and Markdown; text of others is escaped."""

from __future__ import annotations

import html
import math

from .cloth_client import ClothClient

_GOOD, _WARN, _OFF = '#1b7a5a', '#b3541e', '#868e96'


def no_cloth(domain: int) -> str:
    """Return what the page says while there is no cloth on a ROS domain, as Markdown."""
    return f"""\
### No cloth is heard

Nothing publishes particles on ROS domain {domain}. Start a cloth in another terminal, with
`ROS_DOMAIN_ID={domain}`:

```
make run
```

or, with ROS 2 sourced,

```
ros2 run cloth_ros cloth_node
```

It appears here by itself."""


def state(client: ClothClient) -> str:
    """Return the state of a cloth in some words, as HTML."""
    if client.problem:
        colour, text = _WARN, f'particles that cannot be shown: {client.problem}'
    elif client.sheet is None:
        colour, text = _OFF, 'waiting for the first particles'
    elif not client.has_publisher:
        colour = _WARN
        text = f'{client.name.node} has ended; the last state is shown until it is started again'
    elif not client.is_live:
        colour, text = _WARN, 'no particles come; the last state is shown'
    elif client.paused:
        colour, text = _OFF, 'paused'
    elif not client.can_be_commanded:
        colour, text = (
            _GOOD,
            'only topics are heard, as of a recording: nothing to command',
        )
    else:
        factor = client.number('real-time factor')
        text = client.message or 'running'
        if math.isfinite(factor):
            text = f'real-time factor {factor:.2f}: {text}'
        colour = _WARN if client.level not in (b'\0', 0) else _GOOD
    escaped = html.escape(text)
    # Of constant height: what is below must not move while someone is about to click it.
    return (
        f'<div title="{escaped}" style="margin:0.2em 0.9em 0.5em;font-size:0.9em;'
        'line-height:1.35;height:2.7em;overflow:hidden">'
        f'<span style="color:{colour}">●</span> {escaped}</div>'
    )


def scene_information(client: ClothClient) -> str:
    """Return a table of what is known about a cloth, as HTML."""
    rows: list[tuple[str, str]] = []
    sheet, values = client.sheet, client.parameters.values
    if sheet is not None:
        lines, columns = sheet.shape
        rows.append(('particles', f'{lines} rows × {columns} columns = {lines * columns}'))
        rows.append(('frame', sheet.frame_id))
    rows.append(('received', f'{client.rate:.0f} states per second'))
    if 'rate' in values:
        rows.append(('ticks', f'{values["rate"]:g} per second'))
    for key, name in (
        ('simulated time [s]', 'simulated time, s'),
        ('load [share of real time]', 'load, share of real time'),
        ('substeps in the last tick', 'substeps per tick'),
        ('method', 'method'),
        ('largest stretch', 'largest stretch'),
    ):
        if key in client.values:
            rows.append((name, client.values[key]))
    rows.append(('topics', client.name.resolve('~/particles')))
    rows.append(('', client.name.resolve('wind')))
    rows += [('', client.poses.topic(name)) for name in client.poses.present]
    body = ''.join(
        '<tr><td style="padding-right:0.8em;opacity:0.65;white-space:nowrap;vertical-align:top">'
        f'{html.escape(name)}</td><td>{html.escape(text)}</td></tr>'
        for name, text in rows
    )
    return (
        '<table style="margin:0 0.9em 0.5em;font-size:0.8em;line-height:1.4">'
        f'<tbody>{body}</tbody></table>'
    )
