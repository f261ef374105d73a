"""Tables of contact in the report of `make bench`, from results as the benchmarks record them."""

from bench.contact_report import contact_table, drop_table


def cost(state: str, size: int, nanoseconds: float) -> dict:
    steps = size**2 * 50
    return {
        'state': state,
        'size': size,
        'threads': 1,
        'steps': steps,
        'median': 1e-9 * nanoseconds * steps,
    }


def cells(text: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.split('|')[1:-1]] for line in text.splitlines()]


def test_contact_is_a_ratio_to_the_hanging_sheet_of_the_same_size():
    entries = [cost('hanging', 32, 6.0), cost('lying box', 32, 9.0)]
    entries += [cost('hanging', 64, 4.0), cost('lying box', 64, 8.0), cost('falling box', 64, 5.0)]
    # Without a hanging sheet there is nothing to compare with.
    entries += [cost('lying box', 128, 8.0)]
    head, _, *rows = cells(contact_table(entries))
    assert head == ['sheet', '32², 1 thread', '64², 1 thread']
    assert rows == [
        ['hanging, ns', '6.00', '4.00'],
        ['lying on box', '1.50', '2.00'],
        ['falling on box', '', '1.25'],
    ]


def drop(engine: str, ticks_per_second: float, **information: object) -> dict:
    return {
        'engine': engine,
        'support': 'box',
        'size': 16,
        'median': 1 / ticks_per_second,
        'settings': '',
        'held': True,
        'depth': 0.0024,
        'deepest': 0.0312,
        'stretch': 0.051,
        'speed': 0.4,
        **information,
    }


def test_an_engine_that_fails_is_not_compared():
    fails = {'held': False, 'depth': None, 'deepest': None, 'stretch': None, 'speed': None}
    entries = [drop('fast', 1e5, **fails), drop('slow', 60.0), drop('cloth_ros', 600.0)]
    _, _, *rows = cells(drop_table(entries, 'box'))
    assert [row[1] for row in rows] == ['cloth_ros', 'slow', 'fast']
    assert rows[0][2:8] == ['10', '1', '2.4', '31.2', '0.05', '0.40']
    assert rows[1][2:4] == ['1', '10']
    assert rows[2][2:8] == ['fell through or flew apart', '', '', '', '', '']
    alone = cells(drop_table([drop('slow', 60.0), drop('cloth_ros', 600.0, **fails)], 'box'))
    assert alone[2][2:4] == ['1', '']
    assert len(cells(drop_table(entries, 'table'))) == 2
