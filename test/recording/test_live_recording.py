"""Sessions of a real node, recorded from DDS by a second process, are repeated to the bit."""

import pytest
from builders import ROOT, SCENE_FILES
from sessions import CHANGES, compile_kernels, record_session

from cloth_ros import Scene
from cloth_ros.recording import run
from cloth_ros.recording.bag import Bag, deserialise


def check(path):
    outcome = run.repeat(path, None, lambda *_: None)
    assert outcome.identical, outcome.lines
    assert not outcome.result['gaps'] + outcome.result['defects']
    return outcome.result


def test_a_session_is_repeated_to_the_bit(start_cloth, probe, domain, tmp_path):
    scene = ROOT / 'config/drop_on_sphere.yaml'
    ran = Scene.from_yaml(scene)
    start_cloth('--params-file', str(scene))
    record_session(probe, domain, scene, tmp_path / 'bag', 120)
    result = check(tmp_path / 'bag')
    assert result['states'] > 60
    # The scene as it ran, for people, and for a node.
    texts = [each for each in Bag(tmp_path / 'bag').messages() if each.topic == '/cloth/scene']
    assert len(texts) >= 2  # that at the start, and that after the change
    for text, changes in ((texts[0], {}), (texts[-1], CHANGES)):
        (tmp_path / 'scene.yaml').write_text(deserialise(text).data)
        assert Scene.from_yaml(tmp_path / 'scene.yaml') == ran.with_parameters(changes)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize('scene', SCENE_FILES, ids=lambda path: path.stem)
def test_ten_seconds_of_each_scene_are_repeated_to_the_bit(
    scene, start_cloth, probe, domain, tmp_path
):
    compile_kernels(scene)
    start_cloth('--params-file', str(scene))
    record_session(probe, domain, scene, tmp_path / 'bag', 600)
    result = check(tmp_path / 'bag')
    assert result['states'] > 300
