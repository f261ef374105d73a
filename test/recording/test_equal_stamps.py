"""States with equal stamps: a node that is the clock is paused, stepped and reset repeatedly."""

from geometry_msgs.msg import Vector3Stamped
from rclpy.qos import QoSProfile
from ros import wind
from sensor_msgs.msg import PointCloud2
from sessions import recorder
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from cloth_ros.live.tick_record import decode_record
from cloth_ros.recording import run


def test_states_with_equal_stamps_are_repeated_to_the_bit(start_cloth, probe, domain, tmp_path):
    """After each reset the first step has another wind, so another state at the same time."""
    start_cloth('-p', 'clock.publish:=true', '-p', 'sheet.rows:=8', '-p', 'sheet.columns:=8')
    ticks = []

    def take(text):
        ticks.append(decode_record(text.data))

    probe.create_subscription(String, '/cloth/ticks', take, QoSProfile(depth=1000))
    particles = probe.collect(PointCloud2, '/cloth/particles', 1000)
    blow = probe.publisher(Vector3Stamped, '/wind')

    def call(name):
        """Call a service, and let the paused cloth publish its state some times."""
        assert probe.call(Trigger, f'/cloth/{name}', Trigger.Request()).success
        count = len(particles)
        probe.spin_until(lambda: len(particles) > count + 3)

    with recorder(domain, tmp_path / 'bag') as process:
        process.wait_for_output('recording; from here on')
        count = len(particles)
        probe.spin_until(lambda: len(particles) > count + 20)
        assert probe.call(SetBool, '/cloth/pause', SetBool.Request(data=True)).success
        for speed in (1.0, 3.0, 3.0, 9.0):
            for _ in range(20):  # the wind may arrive after the request for a step
                call('reset')
                blow.publish(wind(y=speed))
                call('step')
                if ticks[-1].wind[1] == speed:
                    break
            call('step')
        assert probe.call(SetBool, '/cloth/pause', SetBool.Request(data=False)).success
        count = len(particles)
        probe.spin_until(lambda: len(particles) > count + 20)
        assert process.stop() == 0
    first = [each for each in ticks if each.seconds > 0 and each.time == each.seconds]
    assert len({each.wind for each in first}) >= 3
    assert len({each.stamp for each in first}) < len(first)
    outcome = run.repeat(tmp_path / 'bag', None, lambda *_: None)
    assert outcome.identical, outcome.lines
    assert outcome.result['states'] >= 40
    assert not outcome.result['gaps'] + outcome.result['defects']
