# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What is said on `<node>/changes`: read back as written, and nothing else taken for it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from antenna_drive.limits import CHANGE
from antenna_drive.lockstep.changes import CHANGES, read_record, SETTINGS, write_record
from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.recorder import RunRecorder
from hypothesis import given, strategies as st
import pytest

RUN = 1_700_000_000_000_000
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=20)
bad_runs: list[Any] = ['abc', None, 1e999, float('nan'), 1.5, True, [], {}, -1, 0, 2**60, 10**400]


@pytest.mark.parametrize('key', [SETTINGS, CHANGES])
def test_a_record_is_read_as_it_was_written(key: str) -> None:
    values = {'bias_pot': 0.1 + 0.2, 'waveform': 'multisine', 'frequencies': [0.1, 3.0]}
    assert read_record(write_record(float(RUN), 7, key, values)) == {
        'run': RUN, 'step': 7, key: values}


@pytest.mark.parametrize('text', [
    '', '{', 'null', '7', '[]', '{}', '[' * 100_000, f'{{"run": {RUN}, "step": 0}}',
    f'{{"run": {RUN}, "step": -1, "changes": {{}}}}',
    f'{{"run": {RUN}, "step": "0", "changes": {{}}}}',
    f'{{"run": {RUN}, "step": 0, "changes": []}}',
    f'{{"run": {RUN}, "step": 0, "settings": null}}',
    f'{{"run": {RUN}, "step": 0, "changes": {{"pot": NaN}}}}',
    f'{{"run": {RUN}, "step": 0, "changes": {{"pot": 1e999}}}}',
    f'{{"run": {RUN}, "step": 0, "changes": {{"pot": [[[[[[1]]]]]]}}}}',
    f'{{"run": {RUN}, "step": 0, "changes": {{"pot": "\\ud800"}}}}',
    f'{{"run": {RUN}, "step": 0, "changes": {{"\\ud800": 1}}}}',
    f'{{"run": {"9" * 5000}, "step": 0, "changes": {{}}}}',
    f'{{"run": {RUN}, "step": 0, "changes": {{"pot": "{"x" * CHANGE.default}"}}}}'])
def test_what_is_no_record_is_none(text: str) -> None:
    assert read_record(text) is None


@pytest.mark.parametrize('run', bad_runs)
def test_a_run_is_a_whole_number(run: Any) -> None:
    text = json.dumps({'run': run, 'step': 0, CHANGES: {}})
    assert read_record(text) is None


@given(st.lists(st.tuples(st.sampled_from(['run', 'step', CHANGES, SETTINGS]), json_values)),
       st.booleans())
def test_a_recorder_is_told_anything_and_keeps_what_is_right(
        tmp_path_factory: pytest.TempPathFactory, parts: list[tuple[str, Any]],
        of_this_run: bool) -> None:
    recorder = RunRecorder(Path(tmp_path_factory.mktemp('bag')) / 'a', {'plant/encoder': 'rad'})
    recorder.begin(RUN, 1e-3)
    wrong: Any = {'run': RUN, 'step': 3, **dict(parts)} if of_this_run else dict(parts)
    recorder.told('plant', wrong)
    recorder.step(0, [0.0])
    recorder.told('plant', read_record(json.dumps(wrong)))
    recorder.told('motor_1', {'run': RUN, 'step': 5, CHANGES: {'pot': 0.5}})
    recorder.step(1, [1.0])
    recorder.close()
    bag = read_bag(recorder.path)
    assert len(bag['plant/encoder']) == 2
    assert (5, 'motor_1', {'pot': 0.5}) in [tuple(change) for change in bag.changes]


@pytest.mark.parametrize('run', bad_runs)
def test_a_wrong_run_is_counted(tmp_path: Path, run: Any) -> None:
    recorder = RunRecorder(tmp_path / 'a', {'plant/encoder': 'rad'})
    recorder.begin(RUN, 1e-3)
    recorder.told('plant', {'run': run, 'step': 0, SETTINGS: {'mass': 1.0}})
    recorder.idle()
    assert recorder.refused == 1
    recorder.step(0, [0.0])
    recorder.close()
    assert len(read_bag(tmp_path / 'a')['plant/encoder']) == 1


def test_records_of_runs_that_never_come_are_not_kept_for_ever(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path / 'a', {'plant/encoder': 'rad'})
    recorder.begin(RUN, 1e-3)
    recorder.told('plant', {'run': RUN, 'step': 0, SETTINGS: {'mass': 1.0}})
    for other in range(1, 1000):
        recorder.told('plant', {'run': other, 'step': 0, SETTINGS: {'mass': 2.0}})
    recorder.idle()
    assert recorder.refused > 900
    assert recorder.knows_configuration
    recorder.close()
    assert read_bag(tmp_path / 'a').configuration == {'plant': {'mass': 1.0}}
