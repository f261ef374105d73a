"""
Valid parameters of colliders, as hypothesis strategies.

The files of meshes exist: a node reads those that its scene names.
"""

from __future__ import annotations

import functools
import re
import tempfile
from pathlib import Path

from hypothesis import strategies as st
from meshes import ascii_stl, binary_stl, box, obj

from cloth_ros.scene.collider import SHAPE_PARAMETERS
from cloth_ros.scene.named_group import RESERVED_NAMES

# A value of each parameter of a shape.
SHAPE = {'size': (1.0, 2.0, 0.1), 'radius': 0.2, 'length': 0.5, 'mesh': 'parts/hand.stl'}
NAMES = st.from_regex(re.compile(r'[A-Za-z_][A-Za-z0-9_]{0,63}', re.ASCII), fullmatch=True).filter(
    lambda name: name not in RESERVED_NAMES
)
LENGTHS = st.floats(1e-4, 1e3)
VECTORS = st.tuples(*[st.floats(-1e6, 1e6)] * 3)
TEXTS = st.sampled_from(['hand', 'null', '1e5', '007', 'yes', '~', '0x1F', '/mesh/a b.stl'])
# Names of files that YAML could take for another type, or that need quotes.
_FILES = ('hand.stl', 'a b.STL', 'null.stl', '1e5.obj', '007.stl', "~ it's.obj", '日: #1.stl')
_FOLDER = tempfile.TemporaryDirectory(prefix='cloth_ros_meshes_')


@functools.cache
def mesh_file(name: str) -> str:
    """Return the path of a file with a block of 1 m, in a format that its name says."""
    path, corners = Path(_FOLDER.name) / name, box(1.0, 0.8, 0.6)
    if path.suffix == '.obj':
        path.write_text(obj(corners))
    else:
        content = ascii_stl(corners).encode() if ' ' in name else binary_stl(corners)
        path.write_bytes(content)
    return str(path)


MESHES = st.sampled_from(_FILES).map(mesh_file)


@st.composite
def members(draw: st.DrawFn, *, complete: bool) -> dict[str, object]:
    """Draw parameters of a collider: all that its type needs, and perhaps others."""
    kind = draw(st.sampled_from(sorted(SHAPE_PARAMETERS)))
    usual = {'type': st.just(kind)}
    rest = {
        'size': st.tuples(LENGTHS, LENGTHS, LENGTHS),
        'radius': LENGTHS,
        'length': LENGTHS,
        'mesh': MESHES,
        'position': VECTORS,
        'orientation': st.tuples(*[st.floats(-2, 2)] * 3, st.floats(0.1, 2)),
        'friction': st.floats(0, 10),
        'frame_id': TEXTS,
    }
    needed = {name: rest.pop(name) for name in SHAPE_PARAMETERS[kind]} | usual
    if not complete:
        needed, rest = {}, {**needed, **rest}
    return draw(st.fixed_dictionaries(needed, optional=rest))


@st.composite
def collider_values(draw: st.DrawFn) -> dict[str, object]:
    """Draw the colliders of a scene, and parameters of others, by dotted names."""
    names = draw(st.lists(NAMES, max_size=4, unique=True))
    listed = names[: draw(st.integers(0, len(names)))]
    values: dict[str, object] = {'collider.names': listed or draw(st.sampled_from([[], ['']]))}
    for name in names:
        drawn = draw(members(complete=name in listed))
        values |= {f'collider.{name}.{field}': value for field, value in drawn.items()}
    return values
