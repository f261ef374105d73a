"""Messages of particles, of the node and of others."""

from array import array

import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2, PointField

from cloth_ros.viewer.particles import decode


def cloud(rows=3, columns=2, order='<', names=('x', 'y', 'z', 'vx', 'vy', 'vz'), gap=0):
    """Return a message whose numbers count up, with some bytes between the points."""
    step = 4 * len(names) + gap
    data = np.zeros((rows * columns, step), np.uint8)
    numbers = np.arange(rows * columns * len(names), dtype=np.float32)
    data[:, : 4 * len(names)] = numbers.astype(order + 'f4').view(np.uint8).reshape(len(data), -1)
    message = PointCloud2(
        height=rows,
        width=columns,
        is_bigendian=order == '>',
        point_step=step,
        row_step=step * columns,
        fields=[
            PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
            for index, name in enumerate(names)
        ],
    )
    message.data.frombytes(data.tobytes())
    return message


@pytest.mark.parametrize(('order', 'gap'), [('<', 0), ('>', 0), ('<', 8)])
def test_any_layout_is_read(order, gap):
    sheet = decode(cloud(order=order, gap=gap))
    assert sheet.shape == (3, 2)
    np.testing.assert_array_equal(sheet.positions[2, 1], [30, 31, 32])
    np.testing.assert_array_equal(sheet.velocities[0, 1], [9, 10, 11])


def test_velocities_that_are_not_published_are_those_since_the_last_message():
    first, second = cloud(names=('x', 'y', 'z')), cloud(names=('x', 'y', 'z'))
    second.header.stamp.nanosec = 500_000_000
    for index in range(0, 72, 12):  # x of each particle
        number = np.frombuffer(second.data[index : index + 4], np.float32) + np.float32(3)
        second.data[index : index + 4] = array('B', number.tobytes())
    former = decode(first)
    assert not former.velocities.any()
    sheet = decode(second, former)
    np.testing.assert_array_equal(sheet.positions[2, 1], [18, 16, 17])
    np.testing.assert_array_equal(sheet.velocities, np.broadcast_to([6, 0, 0], (3, 2, 3)))
    paused = decode(second, sheet)
    np.testing.assert_array_equal(paused.velocities, sheet.velocities)
    assert not decode(first, sheet).velocities.any()  # the clock has jumped back


def test_what_is_no_cloth_is_refused():
    with pytest.raises(ValueError, match="no FLOAT32 field 'vx'"):
        decode(cloud(names=('x', 'y', 'z', 'intensity')))
    short = cloud()
    short.data = short.data[:-1]
    with pytest.raises(ValueError, match='143 bytes, but must be 144'):
        decode(short)
    huge = cloud()
    huge.height = 2**31
    with pytest.raises(ValueError, match='particles, but must be'):
        decode(huge)
    damaged = cloud()
    damaged.data[3] = damaged.data[2] = 0xFF
    with pytest.raises(ValueError, match='not finite'):
        decode(damaged)
