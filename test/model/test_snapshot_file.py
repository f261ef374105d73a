"""Files of snapshots: exact to the bit, replaced at once, and refused where they are damaged."""

import dataclasses
import os
import resource
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from builders import PRECISIONS, ROOT, bits, cloth_of, crumple, examples
from colliders import NAME, each_shape, solid, turn
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Inputs
from cloth_ros.model import snapshot_file
from cloth_ros.model.snapshot_file import decode, encode

SHEET = {'rows': 16, 'columns': 16, 'size': (0.6, 0.6), 'position': (0, 0, 0.5)}


def refusal(data: bytes) -> str:
    """Return why bytes are not accepted: one line with a remedy."""
    with pytest.raises(ValueError, match='; ') as refused:
        decode(data)
    assert str(refused.value).isprintable()
    return str(refused.value)


@pytest.mark.parametrize('precision', PRECISIONS)
@pytest.mark.parametrize('shape', each_shape(('sphere', 'box', 'mesh')))
def test_a_loaded_cloth_continues_with_the_same_bits(shape, precision, tmp_path):
    """In contact, between two gusts, and with commands that are not carried out yet."""
    body = solid(shape, 0.06, tmp_path)
    place, turned = (0.0, 0.0, 0.38), turn((1.0, 1.0, 0.0), 0.3)
    cloth = cloth_of(
        sheet=SHEET, pins=['0,0'], solver__precision=precision,
        wind__gust={'period': 0.03, 'duration': 0.02}, **body.scene(place, turned),
    )  # fmt: skip
    for _ in range(16):
        cloth.advance(1 / 60)
    assert cloth.colliders[NAME].touching
    cloth.wind = (0.3, 0.1, 0.0)
    cloth.move_collider(NAME, (0.0, 0.01, 0.4), turn((0.0, 0.0, 1.0), 0.2))
    path = tmp_path / 'cloth.snapshot'
    cloth.save(path)
    other = Cloth.load(path)
    for _ in range(10):
        assert bits(other.snapshot()) == bits(cloth.snapshot())
        cloth.advance(1 / 60)
        other.advance(1 / 60)


# Damage


@pytest.fixture(scope='module')
def data() -> bytes:
    cloth = cloth_of(sheet__rows=3, sheet__columns=4, sphere__radius=0.1)
    cloth.advance(0.01)
    cloth.move_sphere((0.1, 0.2, 0.3))
    return encode(cloth.snapshot())


def test_a_flipped_bit_anywhere_in_the_header_is_found(data):
    for bit in range(8 * 60):
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        refusal(bytes(damaged))


@examples(3)
@given(share=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_a_flipped_bit_or_a_cut_anywhere_is_found(data, share, bit):
    place = int(share * len(data))
    damaged = bytearray(data)
    damaged[place] ^= 1 << bit
    refusal(bytes(damaged))
    assert 'bytes' in refusal(data[:place]) or place == 0


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        (lambda data: b'', 'does not begin'),
        (lambda data: (ROOT / 'config' / 'gust.yaml').read_bytes(), 'does not begin'),
        (lambda data: data + b'\0', 'checksum'),
        (lambda data: data.replace(b'\r\n', b'\n', 1), 'does not begin'),
        (lambda data: data[:8] + b'\3' + data[9:], 'update cloth_ros'),
    ],
)
def test_the_reason_is_named(data, change, reason):
    assert reason in refusal(change(data))


CHANGES = {
    'a number that is not finite': {'time': float('nan')},
    'time before the start': {'time': -1.0},
    'text for a number': {'work': 'much'},
    'an unknown field': {'other': 1},
    'no colliders': {'contact': None},
    'a scene that is none': {'scene': {'sheet.rows': 'many'}},
    'a parameter that there is not': {'scene': {'sheet.rows': 3, 'depth': 4}},
    'another sheet': {'scene': {'sphere.radius': 0.1}},
    'objects': {'position': ['|O', [3, 4], b'']},
    'another shape': {'position': ['<f4', [2**62, 2**62], b'']},
    'too few numbers': {'position': ['<f4', [3, 100], bytes(16)]},
    'an origin of integers': {'origin': ['<i8', [3], bytes(24)]},
    'a collider that there is not': {'collider_paths': {'box': []}},
    'a waypoint that is not finite': {'collider_paths': {'sphere': [[float('inf'), *[0] * 5, 1]]}},
    'an orientation of no length': {'collider_paths': {'sphere': [[0.0] * 7]}},
    'nesting': {'scene': [[[[[]]]]]},
    'an account of another division': {'account': [[0.0, 0.0, 0.0], 0.0, 3, 0, 0]},
}


@pytest.mark.parametrize('change', CHANGES.values(), ids=CHANGES)
def test_content_of_another_program_is_refused(data, change):
    """Although its checksum is right."""
    content = msgspec.msgpack.decode(data[snapshot_file._BEGIN :])
    assert decode(signed(content))
    assert 'not a snapshot' in refusal(signed(content | change))


@pytest.mark.parametrize('field', ['position', 'velocity'])
@pytest.mark.parametrize(('place', 'value'), [(0, 0.5), (20, np.nan)])
def test_ghosts_that_move_and_particles_nowhere_are_refused(data, field, place, value):
    content = msgspec.msgpack.decode(data[snapshot_file._BEGIN :])
    dtype, shape, numbers = content[field]
    array = np.frombuffer(numbers, dtype).copy()
    array[place] = value
    refusal(signed(content | {field: [dtype, shape, array.tobytes()]}))


def signed(content: object) -> bytes:
    """Return content with a header."""
    data = bytearray(snapshot_file._BEGIN) + msgspec.msgpack.encode(content)
    length = len(data) - snapshot_file._BEGIN
    snapshot_file._HEADER.pack_into(data, 0, snapshot_file._SIGNATURE, 1, length)
    data[snapshot_file._HEADER.size : snapshot_file._BEGIN] = snapshot_file._digest(data)
    return bytes(data)


def test_infinite_numbers_are_kept_where_a_state_has_them():
    snapshot = cloth_of(sheet__rows=3, sheet__columns=4, sphere__radius=0.1).snapshot()
    assert snapshot.contact is not None
    contact = snapshot.contact._replace(moved=np.inf)
    snapshot = dataclasses.replace(snapshot, contact=contact, work=np.inf, inputs=Inputs())
    assert bits(decode(encode(snapshot))) == bits(snapshot)


# Files


def test_what_cannot_be_written_or_read_leaves_the_file_as_it_was(tmp_path):
    cloth = crumple(cloth_of(sheet__rows=40, sheet__columns=40), 0.01)
    path = tmp_path / 'cloth.snapshot'
    link = tmp_path / 'link'
    link.symlink_to(path)
    cloth.save(link)
    before = path.read_bytes()
    assert link.is_symlink()
    for wrong in (tmp_path, tmp_path / 'none' / 'file', path / 'file'):
        with pytest.raises((OSError, ValueError), match=str(wrong)):
            cloth.save(wrong)
        with pytest.raises((OSError, ValueError), match=r'folder|o such file|ot a directory'):
            Cloth.load(wrong)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) // 2, hard))
    try:
        with pytest.raises(OSError, match=f'too large.*{path}'):
            cloth.save(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == ['cloth.snapshot', 'link']
    path.write_bytes(before[:-1])
    with pytest.raises(ValueError, match=rf'{path}: incomplete.*; '):
        Cloth.load(path)


SAVE_ALWAYS = """
import sys
from cloth_ros import Cloth, Scene

cloth = Cloth(Scene(sheet={'rows': 64, 'columns': 64}))
while True:
    cloth.save(sys.argv[1])
    print(flush=True)
"""


@pytest.mark.parametrize('number', range(4))
def test_a_kill_in_the_middle_of_a_save_leaves_a_whole_file(number, tmp_path):
    """Nor does a reader meanwhile see half of one."""
    path = tmp_path / 'cloth.snapshot'
    process = subprocess.Popen(
        [sys.executable, '-c', SAVE_ALWAYS, str(path)], cwd=ROOT, stdout=subprocess.PIPE
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline()
        for _ in range(20 + 7 * number):
            whole = path.read_bytes()
            assert decode(whole)
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
    assert path.read_bytes() == whole  # the same state each time
    (kept,) = {Path(name).name for name in os.listdir(tmp_path)} - leftovers(tmp_path)
    assert kept == 'cloth.snapshot'


def leftovers(folder: Path) -> set[str]:
    return {path.name for path in folder.glob('.cloth.snapshot.*.tmp')}


@pytest.mark.slow  # the distances from a mesh have kernels of their own
def test_a_scene_whose_mesh_is_gone_is_refused(tmp_path):
    cloth = cloth_of(**solid('mesh', 0.06, tmp_path).scene())
    path = tmp_path / 'cloth.snapshot'
    cloth.save(path)
    for mesh in tmp_path.glob('*.stl'):
        mesh.unlink()
    with pytest.raises(ValueError, match=r'mesh.*stl'):
        Cloth.load(path)
