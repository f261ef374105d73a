"""Contents of scene files, most of them damaged, as bytes and as a hypothesis strategy."""

from __future__ import annotations

from hypothesis import strategies as st
from ros import ROOT

SCENES = [path.read_bytes() for path in sorted((ROOT / 'config').glob('*.yaml'))]
HEAD = b'/**:\n  ros__parameters:\n'
# What may replace a value, or stand between two lines.
TOKENS = [
    token.decode('unicode_escape').encode('latin-1')
    for token in rb"""
    \t \0 \xff\xfe \xef\xbb\xbf \xed\xa0\x80 \xc2\x85 \x07 \r [ ] { } {} [] : ?\x20 -\x20 | > # @
    ` % = ' " "\\x00" "\\ud800" "\\q" &a\x201 *a &a\x20[*a] <<:\x20*a <<:\x20{} <<:\x203 --- ...
    ---\x20a\n---\x20b %YAML\x209.9 %TAG\x20!\x20x rows:\x203 sheet:\x204 a.b:\x201 !! !\x203
    !!int\x20x !!float\x20x !!bool\x20x !!timestamp\x20x !!binary\x20x !!null\x20x !!str\x203
    !!set\x20{a} !!omap\x20[a:\x201] !!seq\x20{} !x\x20y !!python/object/apply:os.getcwd\x20[]
    !!python/name:os.system !!python/tuple\x20[1] !!python/object/new:os.system\x20["true"]
    2020-01-01 2020-99-99 1:30:00 0o9 0x 0b2 1_000 08 +.e1 .nan .inf -.inf 1e999 1e-999 -0.0 ~ null
    yes on N""".split()
] + [b'9' * 400, b'9' * 5000, b'1.' + b'9' * 5000]


def bomb(*, merged: bool, levels: int = 30) -> bytes:
    """Return a few lines that aliases expand to more than any memory holds."""
    first = b'{x: 1}' if merged else b'[x, x]'
    lines = [b'a0: &a0 ' + first]
    for n in range(1, levels):
        aliases = b'[*a%d, *a%d]' % (n - 1, n - 1)
        lines.append(b'a%d: &a%d ' % (n, n) + (b'{<<: %b}' % aliases if merged else aliases))
    return HEAD + b''.join(b'    %b\n' % line for line in lines)


def bad_files() -> list[bytes]:
    """Return contents that are bad as a whole."""
    return [
        *(b'', b' ', b'\n', b'---\n', b'null', b'[]', b'{}', b'42', b'a', b'\0' * 100),
        *(b'\xff' * 100, bytes(range(256)), b'#' * 10**6, b'\n' * 10**7, b'a: [' + b'1,' * 10**5),
        *(b'/**:', b'/**: {ros__parameters: }', b'/**: {ros__parameters: []}', HEAD),
        *(HEAD + b'    [' * 3, b'[' * 5000, b'{' * 5000, b'- ' * 5000, b'? ' * 5000, b'a: ' * 3),
        *(b'{a: ' * 900 + b'}' * 900, HEAD + b'    pins: ' + b'[' * 900 + b']' * 900),
        *(
            HEAD + b'    pins: [' + b'"0,0",' * 10_000 + b']',
            HEAD + b'    ' + b'x' * 10**5 + b': 1',
        ),
        *(bomb(merged=False), bomb(merged=True), SCENES[0].decode().encode('utf-16')),
        *(
            HEAD + b'    sheet: {rows: 2}\n    sheet.rows: 3\n',
            HEAD + b'    rate: 1\n    rate: 2\n',
        ),
        HEAD + b'    rate: 60\n' + HEAD + b'    drag: 1\n',
        *(HEAD + b'    ? %b\n    : 3\n' % key for key in (b'[a, b]', b'{a: b}', b'3')),
        *(HEAD + b'    ' + token + b'\n' for token in TOKENS),
        *(HEAD + b'    rate: ' + token + b'\n' for token in TOKENS),
        *(HEAD + b'    pins: [' + token + b']\n' for token in TOKENS),
        *(HEAD + b'    gravity: [0.0, ' + token + b', 1.0]\n' for token in TOKENS),
    ]


@st.composite
def damaged_files(draw: st.DrawFn) -> bytes:
    """Draw one of the scenes with parts removed, replaced, repeated, or moved."""
    text = draw(st.sampled_from(SCENES))
    for _ in range(draw(st.integers(1, 3))):
        if draw(st.booleans()):  # any part
            begin = draw(st.integers(0, len(text)))
            end = draw(st.sampled_from([begin, begin + 1, begin + 40, len(text)]))
            part = text[begin:end]
            choices = st.sampled_from([b'', 2 * part]) | st.sampled_from(TOKENS) | st.binary()
            text = text[:begin] + draw(choices) + text[end:]
        else:  # a line
            lines = text.split(b'\n')
            number = draw(st.integers(0, len(lines) - 1))
            name, colon, _ = lines[number].partition(b':')
            if draw(st.booleans()):
                lines[number] = name + colon + b' ' + draw(st.sampled_from(TOKENS))
            else:
                lines.insert(draw(st.integers(0, len(lines))), lines[number])
            text = b'\n'.join(lines)
    return text
