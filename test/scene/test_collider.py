"""Colliders as parameters of a scene."""

import pytest
from builders import SCENE_FILES, examples, scene_of
from hypothesis import given
from hypothesis import strategies as st
from rclpy.validate_full_topic_name import validate_full_topic_name
from reliability.collider_values import SHAPE, collider_values
from remedies import as_in_a_file, as_set, follow
from ros import dumped

from cloth_ros import ColliderParameters, Scene
from cloth_ros.scene.collider import MAX_COLLIDERS, SHAPE_PARAMETERS
from cloth_ros.scene.named_group import RESERVED_NAMES
from cloth_ros.scene.parameter import MEMBERS, declaration, is_group, unknown_parameter_error
from cloth_ros.scene.plausibility import implausible_values

SHAPE_NAMES = ['type', 'size', 'radius', 'length', 'mesh']
TABLE = {'collider.names': ['table'], 'collider.table.type': 'box'}
BOX = {**TABLE, 'collider.table.size': [1.0, 2.0, 0.1]}


def test_the_types_are_those_of_the_interface():
    assert list(SHAPE_PARAMETERS) == ['plane', 'sphere', 'box', 'capsule', 'cylinder', 'mesh']
    expected = [*SHAPE_NAMES, 'friction', 'position', 'orientation', 'frame_id']
    assert list(MEMBERS['collider']) == expected


@pytest.mark.parametrize('kind', SHAPE_PARAMETERS)
def test_a_collider_needs_what_its_type_has_and_nothing_else(kind):
    given_values = {field: SHAPE[field] for field in SHAPE_PARAMETERS[kind]}
    scene = Scene(collider={'names': ['one'], 'one': {'type': kind, **given_values}})
    (collider,) = scene.colliders
    assert (collider.name, collider.type, collider.unused) == ('one', kind, ())
    assert {field: getattr(collider, field) for field in given_values} == given_values
    assert (collider.friction, collider.orientation) == (0.3, (0.0, 0.0, 0.0, 1.0))
    for field in given_values:
        without = {name: value for name, value in given_values.items() if name != field}
        with pytest.raises(ValueError, match=rf'^collider\.one\.{field} is .* a {kind}; write '):
            Scene(collider={'names': ['one'], 'one': {'type': kind, **without}})


def test_colliders_are_in_the_order_of_their_names_after_the_sphere():
    scene = scene_of(
        **{'collider__names': ['b', 'a'], 'collider__a__type': 'plane'},
        **{'collider__b__type': 'sphere', 'collider__b__radius': 0.1},
    )
    assert [each.name for each in scene.colliders] == ['b', 'a']
    assert scene.all_colliders() == scene.colliders
    sphere = {'sphere.radius': 0.2, 'sphere.position': [1, 2, 3], 'sphere.friction': 0.5}
    first, *others = scene.with_parameters(sphere).all_colliders()
    assert first == ColliderParameters(
        name='sphere', type='sphere', radius=0.2, position=(1.0, 2.0, 3.0), friction=0.5
    )
    assert tuple(others) == scene.colliders


def test_a_scene_without_colliders_has_no_parameter_but_their_names():
    assert [name for name in Scene().flat() if name.startswith('collider')] == ['collider.names']
    assert Scene().colliders == Scene().all_colliders() == ()


def test_a_collider_is_prepared_before_it_is_named_and_removed_with_its_parameters():
    scene = Scene()
    for name, value in reversed(BOX.items()):
        assert scene.colliders == ()
        scene = scene.with_parameters({name: value})
    assert scene == Scene.from_parameters(BOX)
    both = scene.with_parameters({'collider.other.friction': 1.0})
    assert [each.name for each in both.collider.unnamed] == ['other']
    # Of the names that it does not contain, only what is given in the same change remains.
    empty = both.with_parameters({'collider.names': [], 'collider.third.friction': 1.0})
    assert [each.name for each in empty.collider.members] == ['third']
    assert both.with_parameters({'collider': {'names': ['']}}) == Scene()


def test_a_collider_is_replaced_as_a_whole_or_changed_in_part():
    scene = Scene.from_parameters(BOX)
    whole = ColliderParameters(name='table', type='plane', friction=0.0)
    assert scene.with_parameters({'collider.table': whole}).colliders == (whole,)
    (changed,) = scene.with_parameters({'collider.table': {'friction': 0.0}}).colliders
    assert (changed.type, changed.size, changed.friction) == ('box', (1.0, 2.0, 0.1), 0.0)
    assert scene.with_parameters({'collider': Scene().collider}) == Scene()


@pytest.mark.parametrize(
    ('changes', 'parts'),
    [
        ({'collider.table.type': 'boxes'}, ["'boxes'", "'plane', 'sphere'", 'write "box"']),
        ({'collider.table.type': ''}, ['collider.table.type is not given', 'write "plane"']),
        ({'collider.table.size': [1, 2, 0]}, ['[1.0, 2.0, 0.0', '0.0001 to 1000 m, for a box']),
        ({'collider.table.size': 0.5}, ['3 numbers, each 0 to 1000 m']),
        ({'collider.table.type': 'sphere'}, ['collider.table.radius is 0.0', 'write 0.1']),
        ({'collider.table.type': 'mesh'}, ['collider.table.mesh is not given', 'STL or OBJ']),
        ({'collider.table.orientation': [0, 0, 0, 0]}, ['a quaternion other than zero']),
        ({'collider.table.orientation': [0, 0, 0, float('nan')]}, ['nan', 'finite']),
        ({'collider.table.position': [0, 0, float('inf')]}, ['inf', 'finite', 'm; write']),
        ({'collider.table.friction': -1}, ['0 to 10']),
        ({'collider.table.mass': 1}, ["'collider.table.mass' is not a parameter", 'did you mean']),
        ({'collider.table.radios': 1}, ["did you mean 'collider.table.radius'?"]),
        ({'colliders.table.radius': 1}, ["did you mean 'collider.table.radius'?"]),
        ({'collider.table': 3}, ['collider.table is 3', 'write collider.table.type: "plane"']),
        ({'collider.names': ['table', 'table']}, ['names[1]', 'not used twice', '"table_2"']),
        ({'collider.names': ['2nd']}, ["'2nd'", 'no digit first', 'write "_2nd"']),
        ({'collider.names': ['a b']}, ["'a b'", 'write "a_b"']),
        ({'collider.names': ['sphere']}, ["'sphere'", 'sphere.radius', 'write "sphere_2"']),
        ({'collider.names': ['tabel']}, ['collider.tabel.type is not given']),
        ({'collider.2nd.friction': 1.0}, ["the name of a collider is '2nd'"]),
        ({'collider.names.type': 'box'}, ['collider.names is']),
    ],
)
def test_what_is_wrong_is_refused_in_one_line(changes, parts):
    scene = Scene.from_parameters(BOX)
    with pytest.raises(ValueError, match='; ') as refusal:
        scene.with_parameters(changes)
    message = str(refusal.value)
    assert all(part in message for part in parts), message
    assert message.isprintable()


@pytest.mark.parametrize('name', RESERVED_NAMES)
def test_a_name_that_exists_is_refused(name):
    with pytest.raises(ValueError, match='that exists') as refusal:
        Scene.from_parameters({'collider.names': [name]})
    assert f'write "{name}_2"' in str(refusal.value)


def test_a_misspelt_name_in_the_list_is_answered_with_the_one_that_has_parameters():
    values = {**BOX, 'collider.names': ['tabel']}
    (error,) = follow(values, Scene.from_parameters)
    assert error.endswith('write collider.names: ["table"]')


def test_too_many_colliders_are_refused():
    def attempt(count: int, *, named: bool) -> Scene:
        names = [f'c{n}' for n in range(count)]
        planes = {name: {'type': 'plane'} for name in names}
        return Scene(collider={'names': names if named else [], **planes})

    assert len(attempt(MAX_COLLIDERS, named=True).colliders) == MAX_COLLIDERS
    for named in (True, False):
        with pytest.raises(ValueError, match=f'is {MAX_COLLIDERS + 1}, but must be at most 64'):
            attempt(MAX_COLLIDERS + 1, named=named)


def test_parameters_without_effect_and_lengths_in_another_unit_are_pointed_out():
    scene = Scene.from_parameters(
        {**BOX, 'collider.table.radius': 0.2, 'collider.table.mesh': 'x'}
    )
    found = implausible_values(scene)
    assert set(found) == {'collider.table.radius', 'collider.table.mesh'}
    text = 'collider.table.radius is 0.2: it has no effect on a box, which has size'
    assert found['collider.table.radius'] == text
    long = scene.with_parameters({'collider.table.size': [1, 150, 1]})
    assert 'in metres' in implausible_values(long)['collider.table.size']
    assert implausible_values(Scene.from_parameters(BOX)) == {}


@examples(1)
@given(values=collider_values())
def test_colliders_are_saved_and_read_again(values, tmp_path_factory):
    scene = Scene.from_parameters(values)
    flat = scene.flat()
    assert Scene.from_parameters(flat) == scene
    assert scene.with_parameters({}) == scene
    assert hash(scene) == hash(Scene.from_parameters(flat))
    path = tmp_path_factory.getbasetemp() / 'scene.yaml'
    plain = {name: list(v) if isinstance(v, tuple) else v for name, v in flat.items()}
    path.write_text(dumped(plain))
    assert Scene.from_yaml(path) == scene
    scene.to_yaml(path)
    assert Scene.from_yaml(path) == scene
    for name in flat:
        assert declaration(name) is not None
    for each in scene.colliders:
        assert is_group(f'collider.{each.name}')
        assert validate_full_topic_name(f'/{each.name}/pose')


def near(field: str) -> st.SearchStrategy[object]:
    """Return a strategy of values of a parameter of a collider, many of them wrong."""
    some = [0, -1, 0.5, 1e-9, 1e9, '', 'box', 'Box', '0.5 m', True, None, [], [0, 0, 0]]
    some += [[1, 0, 2], [0, 0, 0, 0], [1, 1], 'x' * 300, [0.0, 0.0, float('nan')], float('inf')]
    return st.sampled_from([*some, SHAPE.get(field, 0.3)])


@pytest.mark.parametrize('typed', [as_in_a_file, as_set])
@examples(1)
@given(
    changes=st.lists(st.sampled_from(sorted(MEMBERS['collider'])), max_size=4).flatmap(
        lambda fields: st.fixed_dictionaries({field: near(field) for field in fields})
    ),
    kind=st.sampled_from(sorted(SHAPE_PARAMETERS)),
)
def test_the_remedies_for_colliders_succeed(changes, kind, typed):
    values = {'collider.names': ['table'], 'collider.table.type': kind}
    values |= {f'collider.table.{field}': value for field, value in changes.items()}
    for error in follow(values, Scene.from_parameters, typed):
        assert error.isprintable()


def test_misspelt_names_of_a_collider_are_answered_with_the_right_one():
    for field in MEMBERS['collider']:
        name = f'collider.table.{field}'
        for wrong in (f'{name}s', name[:-1], name[1:], name.upper(), name.replace('.', '/')):
            assert f'did you mean {name!r}?' in str(unknown_parameter_error(wrong)).replace(
                'TABLE', 'table'
            )


def test_the_files_of_the_package_have_no_parameter_without_effect():
    for path in SCENE_FILES:
        assert Scene.from_yaml(path).collider.unnamed == ()
