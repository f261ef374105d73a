"""Bad messages and requests to a live node."""

from collections import Counter

import numpy as np
import pytest
from builders import examples
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from hypothesis import example, given
from hypothesis import strategies as st
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.serialization import deserialize_message, serialize_message
from reliability.invalid_values import DEFAULTS, NAMES, is_clear, mostly
from reliability.live_node import live_node
from ros import parameter_request, set_parameters
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from cloth_ros.scene.parameter import PARAMETERS

# Live nodes beside faults take minutes, and are no news after each small change.
pytestmark = pytest.mark.slow

CLOCK, REQUESTS = 'rejected messages on /clock', 'rejected requests to set parameters'
KINDS = {'wind': Vector3Stamped, 'sphere_pose': PoseStamped}
SCENE = [
    *('-p', 'sheet.rows:=8', '-p', 'sheet.columns:=8'),
    *('-p', 'sphere.radius:=0.1', '-p', 'sphere.position:=[0.0, 0.0, 3.0]'),
]
# Queues that lose nothing, or the counts would not agree.
for topic in KINDS:
    SCENE += ['-p', f'qos_overrides./{topic}.subscription.depth:=1000']


@pytest.fixture(scope='module')
def node(long):
    """A node for all of these tests."""
    with live_node(*SCENE, timed=long) as node:
        publisher = node.listener.publisher
        node.publishers = {topic: publisher(KINDS[topic], f'/{topic}', 1000) for topic in KINDS}
        yield node


@pytest.fixture(autouse=True)
def checked(node):
    yield
    node.check()


def rejected(node) -> Counter[str]:
    """Return how many inputs the node has refused by its last report."""
    values = node.listener.reports[-1].values
    return Counter({topic: int(values[f'rejected messages on {topic}']) for topic in KINDS})


# Messages

COORDINATES = st.floats(-3, 3) | st.sampled_from(
    (np.nan, np.inf, -np.inf, 5e-324, -5e-324, 2.2e-308, 1e308, -1e308, 1e39, 3.4e38, 2.0**53)
)
COORDINATES |= st.sampled_from((-0.0, 0.0, 1e-9, 999.0, 9.9e3, 1e4, 1.0001e4, -1e6, 1.1e6))
FRAMES = st.sampled_from(['', 'world']) | st.sampled_from(
    ['moon', 'World', '/world', 'world ', 'é', '\U0001f9f5', '\n', 'x' * 10_000]
)
SECONDS = st.sampled_from([0, 1, -1, -(2**31), 2**31 - 1, 1_700_000_000])
NANOSECONDS = st.sampled_from([0, 1, 10**9 - 1, 10**9, 2**32 - 1])
TIMES = st.builds(Time, sec=SECONDS, nanosec=NANOSECONDS)


def is_valid(message: Vector3Stamped | PoseStamped) -> bool:
    """Return True if the README says that the node accepts a message."""
    if message.header.frame_id not in ('', 'world'):
        return False
    wind = isinstance(message, Vector3Stamped)
    if not wind:
        turn = message.pose.orientation
        largest = np.abs([turn.x, turn.y, turn.z, turn.w]).max()
        if not np.finfo(float).tiny <= largest < np.inf:  # NaN neither
            return False
    place = message.vector if wind else message.pose.position
    vector = np.array([place.x, place.y, place.z])
    if not np.all(np.abs(vector) <= (1e4 if wind else 1e6)):  # NaN neither
        return False
    return wind or bool(np.linalg.norm(vector - (0.0, 0.0, 1.0)) <= 1000.1)  # of the sheet


@st.composite
def messages(draw: st.DrawFn) -> tuple[str, object, bool]:
    """Draw a topic, a message with anything in it, and whether it is valid."""
    topic = draw(st.sampled_from(sorted(KINDS)))
    message = KINDS[topic]()
    message.header.frame_id, message.header.stamp = draw(FRAMES), draw(TIMES)
    if topic == 'wind':
        parts = [(message.vector, 'xyz')]
    else:
        parts = [(message.pose.position, 'xyz'), (message.pose.orientation, 'xyzw')]
    for part, names in parts:
        for name in names:
            setattr(part, name, draw(COORDINATES))
    return topic, message, is_valid(message)


@st.composite
def damaged(draw: st.DrawFn) -> tuple[str, bytes, bool]:
    """Draw a topic, the bytes of a message with some wrong or missing, and whether it is valid."""
    topic = draw(st.sampled_from(sorted(KINDS)))
    message = KINDS[topic]()
    message.header.frame_id = draw(st.sampled_from(['', 'world', 'worlds']))
    text = serialize_message(message)
    length = draw(st.sampled_from([0, 1, 2, 7, 2**16, 2**31, 2**32 - 1])).to_bytes(4, 'little')
    word, begin = draw(st.binary(min_size=4, max_size=4)), draw(st.integers(0, len(text)))
    text = (
        text[: begin // 4 * 4],  # by words, as DDS pads the last one
        text[:begin] + word + text[begin + 4 :],
        text[:12] + length + text[16:],  # of frame_id
        word + text[4:],  # the encapsulation
        text + draw(st.binary(min_size=1, max_size=100)),
    )[draw(st.integers(0, 4))]
    try:
        valid = is_valid(deserialize_message(text, KINDS[topic]))
    except Exception:  # a type of rclpy's own; it is not delivered
        valid = True
    return topic, text, valid


@examples(0.02)
@given(batch=st.lists(messages(), min_size=40, max_size=80))
def test_messages(node, batch, outcomes):
    """Messages on wind and sphere_pose: each is accepted, or refused and counted."""
    expected = rejected(node)
    for topic, message, valid in batch:
        node.publishers[topic].publish(message)
        expected[topic] += not valid
        outcomes['accepted' if valid else 'refused and counted'] += 1
    node.listener.spin_until(lambda: node.listener.next_report() and rejected(node) >= expected)
    assert rejected(node) == expected


@examples(0.015)
@given(batch=st.lists(damaged(), min_size=40, max_size=80))
def test_damaged_messages(node, batch, outcomes):
    """Bytes that are no message, or a damaged one: dropped by DDS, accepted, or counted."""
    before = rejected(node)
    most = before + Counter(topic for topic, _, valid in batch if not valid)
    for topic, text, _ in batch:
        node.publishers[topic].publish(text)
    node.listener.next_report()
    assert before <= rejected(node) <= most
    counted = rejected(node).total() - before.total()
    outcomes['refused and counted'] += counted
    outcomes['dropped or accepted'] += len(batch) - counted


@pytest.fixture
def clock(node):
    """A publisher of /clock, which the node follows meanwhile."""
    set_parameters(node.listener, use_sim_time=True)
    publisher = node.listener.publisher(Clock, '/clock')
    yield publisher
    node.listener.destroy_publisher(publisher)
    set_parameters(node.listener, use_sim_time=False)
    node.recover()


@examples(0.01)
@given(batch=st.lists(TIMES, min_size=60, max_size=90))
def test_clock_messages(node, clock, batch, outcomes):
    """Messages on /clock: followed, replaced by a newer one, or refused and counted."""
    before = int(node.listener.reports[-1].values[CLOCK])
    for moment in [*batch, Time(sec=-1)]:
        clock.publish(Clock(clock=moment))
        node.listener.spin_for(0.003)  # the node keeps the newest only
    bad = 1 + sum(each.sec < 0 or each.nanosec >= 10**9 for each in batch)

    def counted() -> int:
        return int(node.listener.reports[-1].values[CLOCK]) - before

    node.listener.spin_until(lambda: counted() > 0)
    assert counted() <= bad
    outcomes['refused and counted'] += counted()
    outcomes['followed or replaced'] += len(batch) + 1 - counted()


# Services

TEXTS = [
    *('', ' ', 'auto', 'magic', 'double', 'single', 'coarsen', '0,0', '0,:', '99,0', '::0,0'),
    *('a,b', '9' * 200 + ',0', '9' * 5000, '\n', 'x' * 100_000, '-1,-1', '1:1,0', 'é', '0,0,0'),
]
OTHERS = ['', '.', 'sheet', 'rates', 'a b', 'é', 'x' * 10_000, 'use_sim_time', 'sheet.rows.x']
OTHERS += ['collider', 'collider.a', 'collider.2nd.type', 'collider.a.type', 'collider.a.radius']
OTHERS += ['collider.a.size', 'collider.a.frame_id', 'collider.a.x', 'collider.names.type']
ELEMENTS = {
    'bool': [False, True],
    'integer': [0, 1, -1, 2, 3, 7, 65, 1024, 2**31, 2**53 + 1, 2**63 - 1, -(2**63)],
    'double': [np.nan, np.inf, -np.inf, 5e-324, 1e308, -1.0, 0.0, 1e-2, 0.5, 1.0, 2.5, 1e3, 1e9],
    'string': TEXTS,
    'byte': [b'\0', b'\xff', b'a'],
}
SCALARS = ['bool', 'integer', 'double', 'string']
# By number of their type; 0 and some others have none.
FIELDS = dict(enumerate([*SCALARS, *(f'{name}_array' for name in ('byte', *SCALARS))], 1))
OWN = {True: {bool: 1, int: 2, float: 3, str: 4}, False: {float: 8, str: 9}}


@st.composite
def parameters(draw: st.DrawFn) -> Parameter:
    """Draw a parameter, most often of a name and of the type that the node has."""
    name = draw(mostly(st.sampled_from(NAMES), st.sampled_from(OTHERS)))
    kind = draw(st.sampled_from([*range(11), 99, 255]))
    if name in DEFAULTS and draw(st.integers(0, 9)) < 7:
        default = DEFAULTS[name]
        array = isinstance(default, tuple)
        kind = OWN[not array][type((*default, '')[0] if array else default)]
    value, field = ParameterValue(type=kind), FIELDS.get(kind, '')
    element = st.sampled_from(ELEMENTS.get(field.removesuffix('_array'), TEXTS))
    if field.endswith('_array'):
        array = draw(st.lists(element, min_size=3, max_size=3) | st.lists(element))
        setattr(value, f'{field}_value', array * draw(st.sampled_from([1, 1, 1, 100])))
    elif field:
        setattr(value, f'{field}_value', draw(element))
    return Parameter(name=name, value=value)


def all_values(node) -> list[ParameterValue]:
    request = GetParameters.Request(names=NAMES)
    return node.listener.call(GetParameters, '/cloth/get_parameters', request).values


STRANGE = Parameter(name='rate', value=ParameterValue(type=99))  # rclpy's own service ends by it
DRAG = Parameter(name='drag', value=ParameterValue(type=3, double_value=2.0))


@examples(0.2)
@given(batch=st.lists(parameters(), min_size=1, max_size=5), atomically=st.booleans())
@example(batch=[STRANGE, DRAG], atomically=False)
@example(batch=[DRAG, STRANGE], atomically=True)
def test_requests_to_set_parameters(node, batch, atomically, outcomes):
    """Requests to set parameters: set, or refused with a reason, counted, and all as before."""
    before = all_values(node)
    kind = SetParametersAtomically if atomically else SetParameters
    service = '/cloth/set_parameters' + ('_atomically' if atomically else '')
    answer = node.listener.call(kind, service, kind.Request(parameters=batch))
    results = [answer.result] if atomically else answer.results
    subjects = [batch] if atomically else [[each] for each in batch]
    for result, subject in zip(results, subjects, strict=True):
        if not result.successful:
            assert is_clear(result.reason), (subject, result.reason)
        outcomes['set' if result.successful else 'refused'] += 1
    if not any(result.successful for result in results):
        assert all_values(node) == before


def test_refused_requests_are_counted_and_the_node_can_be_restored(node):
    """Changes that only their combination forbids: refused together and counted; then defaults."""
    changes = {name: value for name, value in DEFAULTS.items() if not PARAMETERS[name].fixed}
    kind, service = SetParametersAtomically, '/cloth/set_parameters_atomically'

    def set_all(**more: float):
        parameters = parameter_request({**changes, **more}).parameters
        return node.listener.call(kind, service, kind.Request(parameters=parameters)).result

    def counted(reports: int = 1) -> int:
        return int(node.listener.next_report(reports).values[REQUESTS])

    before, gusts = counted(2), {'wind.gust.period': 2.0, 'wind.gust.duration': 3.0}
    assert 'at most wind.gust.period, 2 s' in set_all(**gusts).reason
    node.listener.spin_until(lambda: counted() > before)
    (alone,) = set_parameters(node.listener, wind__gust__duration=3.0)
    assert alone.successful, 'without gusts it has no effect'
    assert set_all().successful
    node.listener.call(Trigger, '/cloth/reset', Trigger.Request())
    node.recover()


ASKED = {
    '/cloth/get_parameters': GetParameters,
    '/cloth/get_parameter_types': GetParameterTypes,
    '/cloth/describe_parameters': DescribeParameters,
    '/cloth/list_parameters': ListParameters,
}


@examples(0.5)
@given(
    service=st.sampled_from(sorted(ASKED)),
    names=st.lists(st.sampled_from([*NAMES, *OTHERS, *TEXTS]), max_size=4),
    depth=st.sampled_from([0, 1, 2**63, 2**64 - 1]),
)
def test_requests_to_read_parameters(node, service, names, depth, outcomes):
    """Requests to read parameters, most of which do not exist: answered."""
    kind = ASKED[service]
    listed = {'prefixes': names, 'depth': depth}
    request = kind.Request(**(listed if kind is ListParameters else {'names': names}))
    node.listener.call(kind, service, request)
    outcomes['answered'] += 1
