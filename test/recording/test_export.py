"""Recorded particles as a mesh over time: read back with the libraries of each kind of file."""

import signal
import sys
import time
from contextlib import closing
from functools import partial
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from pxr import Usd, UsdGeom
from ros import Process

from cloth_ros.command import run_command
from cloth_ros.recording.bag import Bag
from cloth_ros.recording.export.export import export
from cloth_ros.recording.export.main import main
from cloth_ros.recording.export.mesh_writer import writer_for
from cloth_ros.recording.output_bag import OutputBag

ROWS, COLUMNS = 3, 4
FIRST = 1_700_000_000_123_456_789  # ns
# A tick is late, one is missing, and times are not those of a regular rate.
TIMES = [0.0, 0.02, 0.041, 0.06, 0.1, 0.12, 0.1395]  # s


def state(number, rows=ROWS, columns=COLUMNS):
    """Return x y z vx vy vz of every particle, with numbers that need every bit of a float32."""
    values = np.random.default_rng(number).normal(size=(rows, columns, 6))
    return values.astype(np.float32)


def write_bag(path, *clouds, node='/cloth'):
    """Write states and their times, s."""
    with closing(OutputBag(path, node, 'world')) as bag:
        for time, values in clouds:
            bag.write_particles(FIRST + round(1e9 * time), values)
    return path


@pytest.fixture
def bag(tmp_path):
    states = [(time, state(number)) for number, time in enumerate(TIMES)]
    repeated = (TIMES[-1], state(len(TIMES) - 1))  # of a paused cloth
    return write_bag(tmp_path / 'bag', *states, repeated)


def mesh_of(stage):
    """Return the mesh of a file that is open."""
    return UsdGeom.Mesh(stage.GetDefaultPrim())


def read_usd(path):
    """Return times, s, positions and velocities of a USD file, and its stage."""
    stage = Usd.Stage.Open(str(path))
    mesh = mesh_of(stage)
    codes = mesh.GetPointsAttr().GetTimeSamples()
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (codes[0], codes[-1])
    assert mesh.GetVelocitiesAttr().GetTimeSamples() == codes
    positions = np.array([mesh.GetPointsAttr().Get(code) for code in codes])
    velocities = np.array([mesh.GetVelocitiesAttr().Get(code) for code in codes])
    return np.array(codes) / stage.GetTimeCodesPerSecond(), positions, velocities, stage


def read_pvd(path):
    """Return times, s, positions and velocities of a list of VTU files, and the last mesh."""
    entries = ElementTree.parse(path).getroot().findall('Collection/DataSet')
    meshes = [meshio.read(path.parent / entry.attrib['file']) for entry in entries]
    times = np.array([float(entry.attrib['timestep']) for entry in entries])
    positions = np.array([mesh.points for mesh in meshes])
    return times, positions, np.array([mesh.point_data['velocity'] for mesh in meshes]), meshes[-1]


def assert_states(positions, velocities, numbers):
    """Compare with the states of these numbers, to the bit."""
    assert positions.dtype == velocities.dtype == np.float32
    expected = np.array([state(number).reshape(-1, 6) for number in numbers])
    assert positions.tobytes() == expected[..., :3].tobytes()
    assert velocities.tobytes() == expected[..., 3:].tobytes()


@pytest.mark.parametrize('name', ['cloth.usdc', 'cloth.usd', 'cloth.usda'])
def test_usd_has_every_state_to_the_bit(bag, tmp_path, name):
    assert main([str(bag), str(tmp_path / name)]) == 0
    times, positions, velocities, stage = read_usd(tmp_path / name)
    np.testing.assert_allclose(times, TIMES, rtol=0, atol=1e-6)
    assert_states(positions, velocities, range(len(TIMES)))
    mesh = mesh_of(stage)
    assert stage.GetTimeCodesPerSecond() == 50  # the median of the intervals is 0.02 s
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert UsdGeom.GetStageUpAxis(stage) == 'Z'
    assert mesh.GetDoubleSidedAttr().Get()
    assert mesh.GetSubdivisionSchemeAttr().Get() == 'none'
    assert len(list(tmp_path.iterdir())) == 2  # the bag and the file, nothing temporary
    extents = [mesh.GetExtentAttr().Get(code) for code in mesh.GetPointsAttr().GetTimeSamples()]
    bounds = np.stack([positions.min(axis=1), positions.max(axis=1)], axis=1)
    np.testing.assert_array_equal(np.array(extents), bounds)


def test_the_faces_of_a_flat_sheet_point_along_its_normal(tmp_path):
    flat = np.zeros((ROWS, COLUMNS, 6), np.float32)
    flat[..., 1], flat[..., 0] = np.mgrid[:ROWS, :COLUMNS]
    bag = write_bag(tmp_path / 'bag', (0.0, flat))
    assert (
        main([str(bag), str(tmp_path / 'a.usdc')])
        == main([str(bag), str(tmp_path / 'a.pvd')])
        == 0
    )
    stage = read_usd(tmp_path / 'a.usdc')[-1]
    mesh = mesh_of(stage)
    quads = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 4)
    assert list(mesh.GetFaceVertexCountsAttr().Get()) == [4] * len(quads)
    np.testing.assert_array_equal(read_pvd(tmp_path / 'a.pvd')[-1].cells_dict['quad'], quads)
    corners = flat[..., :3].reshape(-1, 3)[quads]
    sides = np.diff(corners, axis=1)
    np.testing.assert_array_equal(np.cross(sides[:, 0], sides[:, 1]), [[0, 0, 1]] * len(quads))
    cells = {(x, y) for x in range(COLUMNS - 1) for y in range(ROWS - 1)}
    assert {(x, y) for x, y, _ in corners.min(axis=1).tolist()} == cells


def test_a_list_of_vtu_files_has_every_state_to_the_bit(bag, tmp_path):
    assert main([str(bag), str(tmp_path / 'cloth.pvd')]) == 0
    times, positions, velocities, _ = read_pvd(tmp_path / 'cloth.pvd')
    np.testing.assert_allclose(times, TIMES, rtol=0, atol=1e-9)
    assert_states(positions, velocities, range(len(TIMES)))


def test_frames_of_a_regular_rate_are_the_nearest_states(bag, tmp_path):
    assert main([str(bag), str(tmp_path / 'cloth.usdc'), '--fps', '40']) == 0
    times, positions, velocities, stage = read_usd(tmp_path / 'cloth.usdc')
    codes = mesh_of(stage).GetPointsAttr().GetTimeSamples()
    assert codes == [0, 1, 2, 3, 4, 5]  # whole frames, which Blender shows without interpolation
    nearest = [int(np.abs(np.array(TIMES) - time).argmin()) for time in times]
    assert nearest == [0, 1, 2, 3, 4, 5]
    assert_states(positions, velocities, nearest)


def test_a_jump_of_the_clock_is_not_filled_with_frames(tmp_path, capsys):
    """A pause of half a minute is; a day would be a million frames."""
    times = [0.0, 0.1, 30.1, 30.2, 86430.15, 86430.2]
    bag = write_bag(tmp_path / 'bag', *((time, state(n)) for n, time in enumerate(times)))
    assert main([str(bag), str(tmp_path / 'cloth.usdc'), '--fps', '10']) == 0
    codes, positions, _, _ = read_usd(tmp_path / 'cloth.usdc')
    assert len(codes) == 303 + 1
    np.testing.assert_allclose(codes[-2:], [30.2, 86430.2])
    assert positions[-1].tobytes() == state(5).reshape(-1, 6)[:, :3].tobytes()
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith('no state for 86400 s behind 30.200 s: no frames there; --end 31 ')
    assert main([str(bag), str(tmp_path / 'part.usdc'), '--fps', '10', '--end', '31']) == 0
    assert read_usd(tmp_path / 'part.usdc')[0][-1] == pytest.approx(30.2)


def test_a_part_begins_at_time_zero(bag, tmp_path):
    arguments = [str(bag), str(tmp_path / 'cloth.usdc'), '--start', '0.03', '--end', '0.11']
    assert main(arguments) == 0
    times, positions, velocities, _ = read_usd(tmp_path / 'cloth.usdc')
    np.testing.assert_allclose(times, np.array(TIMES[2:5]) - TIMES[2], rtol=0, atol=1e-6)
    assert_states(positions, velocities, [2, 3, 4])


def test_states_without_velocities_are_exported(tmp_path):
    clouds = [(0.0, state(0)), (0.1, state(1)[..., :3]), (0.2, state(2))]  # set meanwhile
    bag = str(write_bag(tmp_path / 'bag', *clouds))
    assert main([bag, str(tmp_path / 'cloth.usdc')]) == main([bag, str(tmp_path / 'a.pvd')]) == 0
    stage = Usd.Stage.Open(str(tmp_path / 'cloth.usdc'))
    mesh = mesh_of(stage)
    assert mesh.GetPointsAttr().GetTimeSamples() == [0, 1, 2]
    assert mesh.GetVelocitiesAttr().GetTimeSamples() == [0, 2]
    positions = np.array([mesh.GetPointsAttr().Get(code) for code in range(3)])
    expected = np.array([state(number).reshape(-1, 6)[:, :3] for number in range(3)])
    assert positions.tobytes() == expected.tobytes()
    middle = meshio.read(tmp_path / 'a_vtu' / '000001.vtu')
    assert middle.points.tobytes() == expected[1].tobytes()
    assert not middle.point_data


def test_states_of_another_grid_or_an_earlier_time_are_left_out(tmp_path, capsys):
    clouds = [(0.0, state(0)), (0.1, state(1)), (0.2, state(3, 5, 5)), (0.3, state(4))]
    early = write_bag(tmp_path / 'early', (0.05, state(2)))
    ordered = write_bag(tmp_path / 'ordered', *clouds)
    with closing(OutputBag(tmp_path / 'bag', '/cloth', 'world')) as bag:
        messages = list(Bag(ordered).messages())
        for number, message in enumerate([*messages[:2], *Bag(early).messages(), *messages[2:]]):
            bag.copy(message._replace(received=number))
    assert main([str(tmp_path / 'bag'), str(tmp_path / 'cloth.pvd')]) == 0
    times, positions, velocities, _ = read_pvd(tmp_path / 'cloth.pvd')
    np.testing.assert_allclose(times, [0, 0.1, 0.3], rtol=0, atol=1e-9)
    assert_states(positions, velocities, [0, 1, 4])
    printed = capsys.readouterr().out.splitlines()
    assert printed == [
        f'3 frames of {ROWS} × {COLUMNS} particles, 0.300 s',
        '1 states left out: their time is before that of an earlier one',
        '1 states left out: their grid is another than that of the first one',
        f'{tmp_path / "cloth.pvd"} written',
    ]


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['cloth.abc'], 'must end in one of .usd, .usdc, .usda, .pvd; write cloth.usdc'),
        (['bag'], 'must end in one of'),
        (['there.usdc'], 'there.usdc exists already; give another name'),
        (['there.pvd'], 'there_vtu exists already; give'),
        (['nowhere/cloth.usdc'], 'nowhere is no folder; make it, or give another name'),
        (['cloth.usdc', '--fps', '0'], '--fps is 0, but must be 0.001 to 1000 Hz; write 24'),
        (['cloth.usdc', '--start', '-1'], '--start is -1, but must be a time from 0 s on'),
        (['cloth.usdc', '--start', '2', '--end', '1'], '--end is 1, but must not be before'),
        (['cloth.usdc', '--start', '9'], 'has no state of /cloth from 9 s on after the first one'),
        (['cloth.usdc', '--cloth', '/lab/cloth'], 'has no cloth /lab/cloth; --cloth can be'),
    ],
)  # fmt: skip
def test_an_error_is_one_line_and_leaves_no_file(bag, tmp_path, capsys, arguments, message):
    (tmp_path / 'there.usdc').touch()
    (tmp_path / 'there_vtu').mkdir()
    before = set(tmp_path.iterdir())
    out, *options = arguments
    assert main([str(bag), str(tmp_path / out), *options]) == 2
    error = capsys.readouterr().err
    assert error.startswith('cloth_export: ')
    assert message in error
    assert error.count('\n') == 1
    assert set(tmp_path.iterdir()) == before


def test_a_single_row_has_no_faces(tmp_path, capsys):
    bag = write_bag(tmp_path / 'bag', (0.0, state(0, 1, 5)))
    assert main([str(bag), str(tmp_path / 'cloth.usdc')]) == 2
    assert 'the sheet has 1 × 5 particles and so no faces' in capsys.readouterr().err


def test_what_to_install_is_said(bag, tmp_path, monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, 'cloth_ros.recording.export.usd', raising=False)
    monkeypatch.setitem(sys.modules, 'pxr', None)  # as where it is not installed
    assert main([str(bag), str(tmp_path / 'cloth.usdc')]) == 2
    wanted = "cloth_export: pxr is not installed; pip install 'cloth_ros[export]'\n"
    assert capsys.readouterr().err == wanted


@pytest.mark.parametrize('name', ['cloth.usda', 'cloth.pvd'])
def test_after_ctrl_c_the_file_is_complete(bag, tmp_path, name, capsys):
    path = tmp_path / name

    def run(stop):
        stop.defer()

        def progress(done, _):
            if done == 4:
                signal.raise_signal(signal.SIGINT)
            stop.check()

        export(bag, None, partial(writer_for(path), path), 0.0, 1.0, 0.0, progress)
        raise AssertionError('it was not stopped')

    assert run_command('cloth_export', 'export', run, stopped='it is complete') == 130
    assert 'cloth_export: stopped; it is complete' in capsys.readouterr().err
    _, positions, velocities, _ = (read_usd if name.endswith('usda') else read_pvd)(path)
    assert_states(positions, velocities, [0, 1, 2])


@pytest.mark.slow
def test_memory_does_not_grow_with_the_bag(tmp_path):
    def peak(count):
        states = ((0.02 * number, state(number, 64, 64)) for number in range(count))
        bag = write_bag(tmp_path / f'bag{count}', *states)
        command = [sys.executable, '-m', 'cloth_ros.recording.export.main', str(bag)]
        process = Process([*command, str(tmp_path / f'{count}.usdc')], None)
        largest = 0.0
        while process.alive:
            try:
                largest = max(largest, process.memory)
            except OSError:  # it has ended meanwhile
                break
            time.sleep(0.01)
        assert process.stop(0) == 0, process.output
        assert (tmp_path / f'{count}.usdc').stat().st_size > count * 64 * 64 * 24
        return largest

    short, long = peak(1000), peak(5000)
    assert long < short + 50, (short, long)  # MB; the states are 94 and 469 MB
