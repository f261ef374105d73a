import numpy as np
from geometry_msgs.msg import WrenchStamped
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message
from rosbags.typesys import Stores, get_typestore

from cloth_ros.messages import cdr
from cloth_ros.messages.wrench import WrenchMessage
from cloth_ros.scene.parameter import one_line

STORE = get_typestore(Stores.ROS2_JAZZY)
PLACEHOLDER = np.array(cdr.sentinel(0, 6)).tobytes()  # a frame may be named like it
vectors = st.tuples(*[st.floats(-1e6, 1e6)] * 3)
frames = st.one_of(
    st.integers(0, 26).map(lambda length: 'f' * length),
    st.sampled_from(
        [one_line(PLACEHOLDER.decode(code, 'ignore')) for code in ('utf-8', 'latin-1')]
    ),
)


@given(force=vectors, torque=vectors, frame=frames)
def test_a_wrench_is_read_as_it_is(force, torque, frame):
    message = WrenchMessage(frame)
    message.serialise(torque, force, 1, 1)  # the second one overwrites the first
    data = message.serialise(force, torque, 1_700_000_001, 999_999_999)
    for each in (
        deserialize_message(data, WrenchStamped),
        STORE.deserialize_cdr(data, 'geometry_msgs/msg/WrenchStamped'),
    ):
        wrench = each.wrench
        assert (wrench.force.x, wrench.force.y, wrench.force.z) == force
        assert (wrench.torque.x, wrench.torque.y, wrench.torque.z) == torque
        assert (each.header.stamp.sec, each.header.stamp.nanosec) == (1_700_000_001, 999_999_999)
        assert each.header.frame_id == frame
