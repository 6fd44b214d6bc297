# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of the pages are those of the result files, and these are not older than the code."""

import json
import re

import pytest
from sampled import sampled

from mlmem_lab import numbers, reach, results, tables
from mlmem_lab.numbers import placed
from mlmem_ros.device import decoding

RESULT = {
    'on': 'EPYC', 'heat': 0.14239, 'reads': 38400, 'rare': 9.6e-5,
    'cases': [{'rail': 22.5, 'speed': 1.9}],
}  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    (tmp_path / 'r.json').write_text(json.dumps(RESULT))
    return tmp_path


@pytest.mark.parametrize(
    ('printed', 'path', 'expected'),
    [
        ('0.999', 'r/heat', '0.142'),
        ('1', 'r/reads', '38 400'),
        ('12 345', 'r/reads', '38 400'),
        ('1.0e-3', 'r/rare', '9.6e-5'),
        ('0.00', 'r/cases/rail=22.5/speed', '1.90'),
        ('0.0', 'r/cases/0/speed', '1.9'),
        ('*a machine*', 'r/on', '*EPYC*'),
    ],
)
def test_a_number_is_placed_and_keeps_its_decimals(folder, printed, path, expected):
    text = placed(f'of {printed}<!-- {path} --> units', folder)
    assert text == f'of {expected}<!-- {path} --> units'
    assert placed(text, folder) == text


def test_a_table_of_entries(folder):
    (folder / 'r.json').write_text(json.dumps({'by': {'one': {'a': 1, 'b': 20000}}}))
    text = placed('<!-- table: r/by: b; a -->\n<!-- end -->', folder)
    assert '|  | b | a |\n|---|---|---|\n| one | 20 000 | 1 |' in text
    assert placed(text, folder) == text


@pytest.mark.parametrize(
    'text',
    ['1<!-- r/none -->', '1<!-- other/heat -->', '1<!-- r/cases/rail=9/speed -->',
     '1<!-- r/cases -->', '1<!-- r/on -->', '*one*<!-- r/heat -->'],
)  # fmt: skip
def test_a_comment_that_names_nothing_of_the_kind_is_refused(folder, text):
    with pytest.raises(ValueError, match=r'r/|other/'):
        placed(text, folder)


def test_the_pages_are_up_to_date(capsys, monkeypatch):
    """Whether the files are older than the code, `make figures-check` tells."""
    monkeypatch.setattr(numbers, 'reasons', lambda made, code: [])
    assert numbers.main(['--check']) == 0, capsys.readouterr().out


def test_a_page_that_differs_is_named(tmp_path, folder, monkeypatch, capsys):
    page = tmp_path / 'README.md'
    page.write_text('0.5<!-- r/heat -->\n')
    monkeypatch.setattr(numbers, 'pages', lambda: [page])
    monkeypatch.setattr(numbers, 'ROOT', tmp_path)
    monkeypatch.setattr(numbers, 'FOLDER', folder)
    assert numbers.main(['--check']) == 1
    assert 'README.md: 0.5<!-- r/heat -->\nmust be: 0.1<!-- r/heat -->' in capsys.readouterr().out
    assert numbers.main([]) == 0
    assert page.read_text() == '0.1<!-- r/heat -->\n'


def test_a_result_of_other_code_is_named(tmp_path, monkeypatch, capsys):
    file = results.save(tmp_path / 'r.json', {}, 'mlmem make', of=['bits_1'])
    assert results.outdated(results.load(file)) == []
    file.write_text(file.read_text().replace(results.fingerprint('bits_1'), 'other'))
    monkeypatch.setattr(numbers, 'FOLDER', tmp_path)
    monkeypatch.setattr(numbers, 'ROOT', tmp_path)
    monkeypatch.setattr(numbers, 'pages', list)
    assert numbers.main(['--check']) == 1
    assert re.search(r'r.json: it is older .* \(bits_1\).*"mlmem make"', capsys.readouterr().out)


def test_an_entry_may_be_called_by_how_much_it_drifts(tmp_path):
    """The code behind it was sought under "0.1 % by ...", found nowhere, and never old."""
    of = results.by(results.save, 'a gain drifts by 0.1 %')
    told = results.load(results.save(tmp_path / 'r.json', {}, 'mlmem make', of=of))
    assert told['fingerprints'] == {of[0]: reach.code('mlmem_lab.results:save')}


@pytest.mark.parametrize('lost', ['an entry by mlmem_lab.gone:made', 'lab/results/gone.json'])
def test_a_result_of_what_was_not_found_is_old(lost, tmp_path):
    told = results.load(results.save(tmp_path / 'r.json', {}, 'mlmem make', of=[lost]))
    assert results.outdated(told) == [lost]


def test_a_fingerprint_tells_elements_apart_and_repeats():
    one = results.fingerprint('bits_1')
    results.fingerprint.cache_clear()
    assert results.fingerprint('bits_1') == one != results.fingerprint('bits_2')


def test_a_change_of_the_rules_of_reading_makes_counts_of_reads_old(monkeypatch):
    """Without one, what is read of `bits_3` is the same again."""

    def read():
        results.fingerprint.cache_clear()
        return results.fingerprint('bits_3, read')

    unchanged = read()
    for rule, value in (('LOUDEST', 1.2), ('MOST_RAISED', 1.3), ('median_low', min)):
        with monkeypatch.context() as patch:
            patch.setattr(decoding, rule, value)
            assert read() != unchanged, rule
    assert read() == unchanged


def test_a_change_of_the_rules_of_reading_leaves_moves_and_ticks_as_they_are(monkeypatch):
    before = results.fingerprint('bits_1')
    monkeypatch.setattr(decoding, 'LOUDEST', 1.2)
    results.fingerprint.cache_clear()
    assert results.fingerprint('bits_1') == before


@pytest.fixture
def edited(monkeypatch):
    """A function that edits the text of a module of ours, for those who ask what it reaches."""

    def edit(module, old, new):
        text = {module: reach.source(module).replace(old, new)}
        assert text[module] != reach.source(module)
        known, parsed = reach.source, reach._module
        monkeypatch.setattr(reach, 'source', lambda name: text.get(name) or known(name))
        other = parsed.__wrapped__(module)
        monkeypatch.setattr(
            reach, '_module', lambda name: other if name == module else parsed(name)
        )
        forget()

    def forget():
        for each in (reach._used, reach._told, reach.code, results.fingerprint):
            each.cache_clear()

    yield edit
    forget()


def codes(file):
    """Return what a file of ours says of code: what it does otherwise takes seconds."""
    told = results.load(results.FOLDER / file)
    some = {name: found for name, found in told['fingerprints'].items() if results.BY in name}
    return told | {'fingerprints': some}


@pytest.mark.parametrize(
    ('module', 'old', 'new', 'aged', 'kept'),
    sampled([
        ('mlmem_lab.designer.proposal', 'GAMMA = -3e-5', 'GAMMA = -9e-5', 'reads', 'times'),
        ('mlmem_lab.twins.sensed', 'KNOWN = 5e-4', 'KNOWN = 5e-2', 'twin', 'reads'),
        ('mlmem_lab.windows.window', 'RADII = (0.05,', 'RADII = (0.07,', 'windows', 'twin'),
    ], lambda case: case[3] == 'windows'),
)  # fmt: skip
def test_a_change_of_a_constant_makes_what_reaches_it_old(edited, module, old, new, aged, kept):
    before = {file: results.outdated(codes(f'{file}.json')) for file in (aged, kept)}
    edited(module, old, new)
    names = results.outdated(codes(f'{aged}.json'))
    assert set(names) > set(before[aged])
    assert results.outdated(codes(f'{kept}.json')) == before[kept]
    [why, *_] = numbers.reasons(numbers.Made(results.FOLDER, None, codes(f'{aged}.json')))
    assert 'older than the code' in why


def test_words_about_code_make_nothing_old(edited):
    before = codes('reads.json')
    edited(
        'mlmem_lab.designer.proposal', 'GAMMA = -3e-5', 'GAMMA = -3e-5  # of the paper\n"""So."""'
    )
    assert results.outdated(codes('reads.json')) == results.outdated(before)


@pytest.fixture
def gallery(tmp_path, monkeypatch):
    """A checkout with a picture of a page, as a command has just made it."""
    monkeypatch.setattr(results, 'uncommitted', list)
    for module in (results, numbers):
        monkeypatch.setattr(module, 'ROOT', tmp_path)
        monkeypatch.setattr(module, 'FOLDER', tmp_path / 'lab' / 'results')
    monkeypatch.setattr(numbers, 'pages', list)
    picture = tmp_path / 'docs' / 'figures' / 'wall.png'
    for folder in (picture.parent, results.FOLDER):
        folder.mkdir(parents=True)
    picture.write_bytes(b'a wall')
    results.keep_picture(picture, 'mlmem figures wall', results.by(tables.reads, 'picture'))
    return picture


def checked():
    results.fingerprint.cache_clear()
    return numbers.main(['--check', '--code'])


def test_a_picture_that_was_replaced_is_named(gallery, capsys):
    assert checked() == 0
    gallery.write_bytes(b'another wall')
    assert checked() == 1
    assert (
        'another file than the one that was made, or drawn from (docs/figures/wall.png)'
        in capsys.readouterr().out
    )
    gallery.write_bytes(b'a wall')
    assert checked() == 0
    gallery.with_name('stranger.png').write_bytes(b'of nobody')
    assert checked() == 1
    assert 'stranger.png: no command is known' in capsys.readouterr().out


def test_what_is_drawn_from_a_result_is_old_with_it(gallery, capsys):
    file = results.save(results.FOLDER / 'r.json', {'reads': 3}, 'mlmem make')
    results.keep_picture(gallery, 'mlmem draw', ['lab/results/r.json'])
    results.save(file, {'reads': 3}, 'mlmem make --again')  # the same numbers
    assert checked() == 0
    results.save(file, {'reads': 4}, 'mlmem make')
    assert checked() == 1
    assert 'drawn from (lab/results/r.json)' in capsys.readouterr().out


def test_what_is_stale_is_listed_with_its_command_and_time(gallery, capsys):
    told = results.load(results.FOLDER / results.PICTURES)
    told['docs/figures/wall.png'] |= {'seconds': 90}
    (results.FOLDER / results.PICTURES).write_text(json.dumps(told))
    assert numbers.main(['--stale']) == 0
    assert capsys.readouterr().out == ''
    gallery.write_bytes(b'another wall')
    results.fingerprint.cache_clear()
    assert numbers.main(['--stale']) == 0
    said = capsys.readouterr().out
    assert said.startswith('docs/figures/wall.png: ')
    assert said.endswith('    mlmem figures wall (90 s)\n')
    assert numbers.main(['--accept', 'docs/figures/wall.png', 'only its frame is new']) == 0
    assert checked() == 0
    capsys.readouterr()
    assert numbers.main(['--stale']) == 0
    assert 'not made again' in capsys.readouterr().out


def test_every_picture_of_the_pages_is_the_one_that_was_made():
    """Whether it is older than the code, `make figures-check` tells."""
    for made in numbers.everything():
        if made.name is not None:
            assert made.says['fingerprints'][made.name] == results.fingerprint(made.name)


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A module that finds the length of a name, run from the command line on committed code."""
    monkeypatch.setattr(results, 'FOLDER', tmp_path)
    monkeypatch.setattr(results, 'uncommitted', list)
    monkeypatch.setattr(results, 'fingerprint', len)

    def run(*arguments):
        return results.run('lengths', 'Measure names.', len, seed=3, arguments=arguments)

    return run


def test_a_subset_updates_its_entries_and_the_command_names_all(study, tmp_path):
    assert study('case_2', 'bits_1') == study('bits_1') == 0
    found = results.load(tmp_path / 'lengths.json')
    assert found['presets'] == {'case_2': 6, 'bits_1': 6}
    assert list(found['fingerprints']) == [
        'case_2',
        'case_2 by builtins:len',
        'bits_1',
        'bits_1 by builtins:len',
    ]
    assert found['command'] == 'python3 -m mlmem_lab.lengths case_2 bits_1'
    assert found['seed'] == 3


def test_without_arguments_a_module_makes_again_what_its_file_has(study, tmp_path, capsys):
    study('case_2', 'bits_1')
    before = results.load(tmp_path / 'lengths.json')
    capsys.readouterr()
    assert study() == 0
    assert capsys.readouterr().out == 'case_2 6\nbits_1 6\n'
    now = results.load(tmp_path / 'lengths.json')
    assert now == before | {'seconds': now['seconds']}  # of the longest run of the program


def test_what_was_accepted_is_forgotten_once_all_is_made_again(study, tmp_path, monkeypatch):
    study('case_2', 'bits_1')
    monkeypatch.setattr(results, 'fingerprint', lambda name: -len(name))
    results.accept(tmp_path / 'lengths.json', 'a comment changed')
    study('bits_1')
    assert 'a comment changed' in results.load(tmp_path / 'lengths.json')['accepted'][0]
    study()
    assert 'accepted' not in results.load(tmp_path / 'lengths.json')


@pytest.mark.parametrize('module', ['times', 'forecasts', 'validity'])
def test_every_module_has_help_and_refuses_strangers(module, capsys):
    for arguments, status in ((['--help'], 0), (['bits_99'], 2)):
        with pytest.raises(SystemExit) as end:
            results.run(module, 'What it measures.', len, arguments=arguments)
        assert end.value.code == status
    said = capsys.readouterr()
    assert 'What it measures.' in said.out
    assert 'bits_99' in said.err


def test_a_result_of_code_that_is_not_committed_is_refused(study, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(results, 'uncommitted', lambda: ['mlmem_ros/x.py'])
    assert study('case_2') == 2
    assert 'commit first' in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
    results.save(tmp_path / 'r.json', {}, 'mlmem make')
    monkeypatch.setattr(numbers, 'FOLDER', tmp_path)
    monkeypatch.setattr(numbers, 'ROOT', tmp_path)
    monkeypatch.setattr(numbers, 'pages', list)
    assert numbers.main(['--check']) == 1
    assert 'not committed (mlmem_ros/x.py)' in capsys.readouterr().out


def test_a_goal_that_is_missed_is_marked():
    result = {
        'rows': [
            {'figure': 'share', 'goal': 'at most 3', 'A': '3.67', 'B': '2.9'},
            {'figure': 'speed', 'goal': 'at least 1000', 'A': '900 (busy)', 'B': '1e4'},
            {'figure': 'memory', 'goal': '', 'A': '200'},
        ]
    }
    assert tables.node_missed(result)[1][2:] == ['**3.67, missed**', '2.9']
    assert tables.node_figures(result)[2][2:] == ['**900 (busy), missed**', '1e4']
    assert tables.node_figures(result)[3][2:] == ['200', '']
    assert [row[0] for row in tables.node_missed(result)] == ['figure', 'share', 'speed']
