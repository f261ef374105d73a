from builders import cloth_of

from cloth_ros.live.report import contact_values


def test_values_of_a_sphere_that_a_sheet_falls_on():
    sphere = {'sphere__radius': 0.3, 'sphere__position': (0.0, 0.0, 0.6)}
    cloth = cloth_of(sheet__rows=9, sheet__columns=9, pins=[''], **sphere)
    assert contact_values(cloth.colliders) == {
        'sphere penetration [m]': 0.0,
        'sphere touching particles': 0,
    }
    cloth.advance(0.5)
    values = contact_values(cloth.colliders)
    assert list(values) == ['sphere penetration [m]', 'sphere touching particles']
    assert values['sphere penetration [m]'] == cloth.sphere_depth
    assert 0 < values['sphere touching particles'] <= 81


def test_a_scene_without_colliders_has_no_values_of_contact():
    assert contact_values(cloth_of(sheet__rows=3, sheet__columns=3).colliders) == {}
