from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import Header

from cloth_ros.messages.diagnostics import diagnostics_message


def test_values_are_written_with_six_digits_under_the_name_of_the_node():
    header = Header(frame_id='world')
    values = {'substep [s]': 1 / 3, 'count': 12345678, 'method': 'verlet'}
    message = diagnostics_message(header, '/a/cloth', 'well', values, DiagnosticStatus.WARN)
    assert message.header == header
    (status,) = message.status
    assert (status.name, status.message) == ('/a/cloth: simulation', 'well')
    assert status.level == DiagnosticStatus.WARN
    assert {item.key: item.value for item in status.values} == {
        'substep [s]': '0.333333', 'count': '12345678', 'method': 'verlet'
    }  # fmt: skip
