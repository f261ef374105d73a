"""Grippers as parameters of a scene."""

import pytest

from cloth_ros import GripperParameters, Scene
from cloth_ros.scene.parameter import MEMBERS, declaration
from cloth_ros.scene.plausibility import implausible_values

TWO = {'gripper.names': ['left', 'right'], 'gripper.left.radius': 0.05}


def test_the_parameters_are_those_of_the_interface():
    expected = ['radius', 'slip_force', 'position', 'orientation', 'frame_id']
    assert list(MEMBERS['gripper']) == expected
    assert declaration('gripper.left.slip_force').spec.unit == 'N'
    assert [name for name in Scene().flat() if name.startswith('gripper')] == ['gripper.names']


def test_grippers_are_written_to_a_file_and_read_again(tmp_path):
    """One with the defaults alone, and one that is prepared, too."""
    scene = Scene.from_parameters({**TWO, 'gripper.spare.radius': 0.02})
    assert [each.name for each in scene.grippers] == ['left', 'right']
    assert scene.grippers[1] == GripperParameters(name='right')
    assert [each.name for each in scene.gripper.unnamed] == ['spare']
    scene.to_yaml(tmp_path / 'scene.yaml')
    assert Scene.from_yaml(tmp_path / 'scene.yaml') == scene
    assert not implausible_values(scene)
    # Of the names that a change does not contain, nothing is left.
    fewer = scene.with_parameters({'gripper.names': ['right']})
    assert [each.name for each in fewer.gripper.members] == ['right']


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'gripper.names': ['wind']}, r"gripper\.names\[0\] is 'wind', .* write \"wind_2\""),
        ({'gripper.names': ['a', 'a']}, r"gripper\.names\[1\] is 'a', .* not used twice"),
        ({'gripper.left.radius': 0.0}, r'gripper\.left\.radius is 0\.0, .* 0\.0001 to 1000 m'),
        ({'gripper.left.slip_force': -1.0}, r'gripper\.left\.slip_force is -1\.0, .* 0 to 1e\+09'),
        (
            {'collider.names': ['right'], 'collider.right.type': 'plane'},
            r"gripper\.names\[1\] is 'right', but must be a name that is not in collider\.names "
            r'too; write "right_2"',
        ),
    ],
)
def test_what_is_not_valid_is_refused_with_a_remedy(changes, reason):
    scene = Scene.from_parameters(TWO)
    with pytest.raises(ValueError, match=f'^{reason}'):
        scene.with_parameters(changes)
