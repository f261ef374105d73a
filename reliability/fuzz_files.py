"""Scene files that were damaged, and what is no scene at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from cloth_ros import Scene
from cloth_ros.scene.parameter import format_value

from .tally import Tally, attempt

READY = [path.read_bytes() for path in sorted(Path('config').glob('*.yaml'))]
_HEAD = b'/**:\n  ros__parameters:\n'
# What may stand in the place of a value, or between two lines.
TOKENS: list[bytes] = [
    *(b'\t', b'\0', b'\xff\xfe', b'\xef\xbb\xbf', b'\xed\xa0\x80', b'\xc2\x85', b'\x07', b'\r'),
    *(
        b'[',
        b']',
        b'{',
        b'}',
        b'{}',
        b'[]',
        b':',
        b'? ',
        b'- ',
        b'|',
        b'>',
        b'#',
        b'@',
        b'`',
        b'%',
    ),
    *(b'&a 1', b'*a', b'&a [*a]', b'<<: *a', b'<<: {}', b'<<: 3', b'!!', b'! 3', b'!!int x', b'='),
    *(b'!!float x', b'!!bool x', b'!!timestamp x', b'!!binary x', b'!!set {a}', b'!!omap [a: 1]'),
    *(b'!!python/object/apply:os.getcwd []', b'!!python/name:os.system', b'!!python/tuple [1]'),
    *(b'!!python/object/new:os.system ["true"]', b'!!null x', b'!!str 3', b'!!seq {}', b'!x y'),
    *(b'2020-01-01', b'2020-99-99', b'1:30:00', b'0o9', b'0x', b'0b2', b'1_000', b'08', b'+.e1'),
    *(
        b'.nan',
        b'.inf',
        b'-.inf',
        b'1e999',
        b'1e-999',
        b'-0.0',
        b'~',
        b'null',
        b'yes',
        b'on',
        b'N',
    ),
    *(
        b'9' * 5000,
        b'9' * 400,
        b'1.' + b'9' * 5000,
        b"'",
        b'"',
        b'"\\x00"',
        b'"\\ud800"',
        b'"\\q"',
    ),
    *(
        b'---',
        b'...',
        b'--- a\n--- b',
        b'%YAML 9.9',
        b'%TAG ! x',
        b'rows: 3',
        b'sheet: 4',
        b'a.b: 1',
    ),
]


def bomb(levels: int = 30) -> bytes:
    """Return a few lines that aliases make into more than any memory holds."""
    lines = ['a0: &a0 [x, x]']
    lines += [f'a{n}: &a{n} [*a{n - 1}, *a{n - 1}]' for n in range(1, levels)]
    return _HEAD + b''.join(b'    ' + line.encode() + b'\n' for line in lines)


def merge_bomb(levels: int = 30) -> bytes:
    """Return the same with merged mappings."""
    lines = ['a0: &a0 {x: 1}']
    lines += [f'a{n}: &a{n} {{<<: [*a{n - 1}, *a{n - 1}]}}' for n in range(1, levels)]
    return _HEAD + b''.join(b'    ' + line.encode() + b'\n' for line in lines)


def whole() -> list[bytes]:
    """Return contents that are bad as a whole."""
    return [
        *(
            b'',
            b' ',
            b'\n',
            b'---\n',
            b'null',
            b'[]',
            b'{}',
            b'42',
            b'a',
            b'\0' * 100,
            b'\xff' * 100,
        ),
        *(bytes(range(256)), b'/**:', b'/**: {ros__parameters: }', b'/**: {ros__parameters: []}'),
        *(_HEAD, _HEAD + b'    [' * 3, b'[' * 5000, b'{' * 5000, b'- ' * 5000, b'? ' * 5000),
        *(_HEAD + b'    pins: ' + b'[' * 900 + b']' * 900, b'a: ' * 3, b'{a: ' * 900 + b'}' * 900),
        *(
            _HEAD + b'    pins: [' + b'"0,0",' * 10_000 + b']',
            _HEAD + b'    ' + b'x' * 10**5 + b': 1',
        ),
        *(b'#' * 10**6, b'\n' * 10**7, b'a: [' + b'1,' * 10**5, bomb(), merge_bomb()),
        *(
            _HEAD + b'    rate: 1\n    rate: 2\n',
            _HEAD + b'    sheet: {rows: 2}\n    sheet.rows: 3\n',
        ),
        *(
            _HEAD + b'    rate: 60\n' + _HEAD + b'    drag: 1\n',
            READY[0].decode().encode('utf-16'),
        ),
        *(
            _HEAD + b'    ? [a, b]\n    : 3\n',
            _HEAD + b'    ? {a: b}\n    : 3\n',
            _HEAD + b'    3: 3\n',
        ),
        *(_HEAD + b'    ' + token + b'\n' for token in TOKENS),
        *(_HEAD + b'    rate: ' + token + b'\n' for token in TOKENS),
        *(_HEAD + b'    pins: [' + token + b']\n' for token in TOKENS),
        *(_HEAD + b'    gravity: [0.0, ' + token + b', 1.0]\n' for token in TOKENS),
    ]


def damaged(generator: np.random.Generator) -> bytes:
    """Return a ready scene with some damage."""
    text = bytearray(READY[generator.integers(len(READY))])
    for _ in range(generator.integers(1, 4)):
        place = int(generator.integers(len(text) + 1))
        length = int(generator.integers(1, 40))
        token = TOKENS[generator.integers(len(TOKENS))]
        kind = generator.integers(8)
        if kind == 0 and text:
            text[place % len(text)] = generator.integers(256)
        elif kind == 1:
            del text[place:]
        elif kind == 2:
            del text[place : place + length]
        elif kind == 3:
            text[place:place] = generator.bytes(length)
        elif kind == 4:
            text[place:place] = text[place : place + length]
        elif kind == 5:
            text[place:place] = token
        else:
            lines = text.split(b'\n')
            number = int(generator.integers(len(lines)))
            name, colon, _ = lines[number].partition(b':')
            if kind == 6:
                lines[number] = name + colon + b' ' + token
            else:
                lines.insert(int(generator.integers(len(lines))), lines[number])
            text = bytearray(b'\n'.join(lines))
    return bytes(text)


def try_file(tally: Tally, path: Path, text: bytes) -> None:
    """Read a scene of this content; a file that is no scene must be named."""
    path.write_bytes(text)
    attempt(tally, text, lambda: Scene.from_yaml(path))


def contents(cases: int) -> Iterator[bytes]:
    """Yield so many contents of files."""
    yield from whole()[:cases]
    generator = np.random.default_rng(0)
    for _ in range(cases - len(whole())):
        yield damaged(generator)


def files(cases: int) -> Tally:
    """Fuzz the contents of files."""
    tally = Tally('scene files, flipped, cut, mixed and forged')
    with tempfile.TemporaryDirectory() as folder:
        for text in contents(cases):
            try_file(tally, Path(folder, 'scene.yaml'), text)
    return tally


def oddities(folder: Path) -> Iterator[object]:
    """Yield paths, and what is none, that lead to no file."""
    os.mkfifo(folder / 'pipe')
    (folder / 'loop').symlink_to('loop')
    (folder / 'unreadable').touch(mode=0)
    yield from ('', '.', folder, folder / 'none', folder / 'pipe', folder / 'loop', '\0', 'x\0y')
    yield from (
        '/dev/zero',
        '/dev/null',
        '/dev/stdin',
        '/dev/full',
        '/proc/self/mem',
        '/proc/kcore',
    )
    yield from (
        'x' * 300,
        'x/' * 5000,
        '\ud800',
        folder / 'unreadable',
        '/proc/self/maps',
        '/dev/tty',
    )
    yield from (None, 0, 1, -1, 10**9, 1.5, True, b'scene.yaml', bytearray(b'x'), [], {}, object())


def paths() -> Tally:
    """Fuzz the paths themselves; what cannot be opened is an OSError, as documented."""
    tally = Tally('paths that lead to no file')

    def read(path: object) -> None:
        try:
            Scene.from_yaml(path)  # type: ignore[arg-type]
        except OSError as error:
            raise ValueError(f'{format_value(path)}: {error.strerror}; correct it') from None

    with tempfile.TemporaryDirectory() as folder:
        for path in oddities(Path(folder)):
            call: Callable[[], None] = lambda path=path: read(path)  # noqa: E731
            if attempt(tally, path, call):
                tally.blame('read', path)
    return tally
