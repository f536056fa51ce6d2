# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Every reader of files and messages, each with files that it accepts."""

from collections.abc import Callable, Mapping
import io
import json
from pathlib import Path
import struct
from typing import Any, NamedTuple

from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.lockstep.changes import read_record
from antenna_drive.lockstep.frame import FrameLayout
from antenna_drive.parameters.files import config_dir
from antenna_drive.parameters.loading import load
from antenna_drive.recording.bag_reader import read_bag
from antenna_drive.recording.bag_writer import write_bag
from antenna_drive.recording.csv_format import read_csv, write_csv
from antenna_drive.recording.files import import_file, load_map
from antenna_drive.recording.recording import Recording
from antenna_drive.recording.sheet import load_sheet, parse_sheet
from lab.calibration.problem import read_problem, SHIPPED
from lab.calibration.search import read_log
from lab.campaign.mutating import as_json, as_yaml
from lab.trials.scorecard import score
from lab.trials.scored_cases import read_scored
from lab.trials.sealing import read_manifest
from lab.trials.verdict import read_verdict
import numpy as np
from scipy.io import savemat
import yaml

SHEET = """\
circuit: new
bias: {type: fixed_step, voltage_V: 5.69, at_s: 1.0}
waveform: {type: multisine, amplitude_deg_s: 0.1, frequencies_hz: [0.1, 0.7], weights: [1, 2]}
sensors: {encoder_bits: 21, tach_noise_rad_s: 0.0035}
elevation_deg: 45.0
"""
MAP = """\
time: {column: t, unit: ms, offset_s: 0.5}
skip_lines: 1
signals:
  rate_command_rad_s: {column: r, unit: deg/s, sign: -1}
  plant/encoder: {column: e, unit: counts, counts_per_revolution: 4096, clock_offset_s: 0.1}
  arm/x: {expression: "2 * r - max(e, 0.5) / column(0) ** 0", unit: mm}
  arm/y: {column: 2, unit: "1", sign_magnitude_bits: 11}
"""
VERDICT = {
    'verdict': 'explained', 'where': [], 'seconds': 3.0,
    'which': [{'effects': ['tooth_wave', 'coulomb_torque'], 'probability': 0.8, 'parameters': {
        'gap': {'value': 1.0, 'ci95': [0.5, 1.5], 'unit': 'rad'}}},
        {'effects': ['unknown'], 'probability': 0.2, 'parameters': {}}],
    'confusable': [['tooth_wave', 'backlash']],
    'how_far': {'explained_fraction': {'value': 0.9, 'ci95': [0.0, 1.0]}}}
MANIFEST = {'format': 1, 'seals': {'case_0001': 'ab' * 32}, 'settings': {'cases': 1, 'seed': 1}}
SCORED = {
    'truth': {'case': 'case_0001', 'seed': [1, 1], 'kind': 'single', 'effects': [
        {'id': 'tach_1.gain', 'size': 0.4, 'parameters': {'error': 0.02}}]},
    'verdict': {**VERDICT, 'which': [{'effects': ['tach_1.gain'], 'probability': 1.0,
                                      'parameters': {'tach_1.gain.change': {
                                          'value': 0.02, 'ci95': [0.0, 0.1], 'unit': '1'}}}]},
    'closed': 0.9}
FIT_LOG = (b'{"problem": "0123", "settings": {}}\n'
           b'{"shares": [0.1, 0.2], "cost": 1.5, "figures": {"a": 1.0}, "complete": true}\n')
CHANGE = {'run': 5, 'step': 0, 'settings': {'bias_pot': 0.5, 'weights': [1.0, 2.0]}}


class Reader(NamedTuple):
    """A reader."""

    file: str                                       # where it reads, below a folder
    content: bytes                                  # a file that it accepts
    read: Callable[[Path], Any]                     # reads the folder's file
    tree: Any = None                                # the content as plain data, or None
    write: Callable[[Any], bytes] | None = None     # how `tree` is written


def one_recording(samples: int = 60) -> Recording:
    """Return a small recording with configuration, notes and sheet."""
    rng = np.random.default_rng(7)
    time = np.arange(samples) * 1e-3
    return Recording.from_arrays(
        time, {name: rng.standard_normal(samples) for name in (
            'test_signal/rate_command', 'motor_1/current', 'plant/encoder')},
        configuration={'axis': {'gear_ratio': 14868.0}}, notes={'source': 'campaign'},
        sheet=parse_sheet({'circuit': 'new'}))


def _yaml_reader(file: str, text: bytes, read: Callable[[Path], Any]) -> Reader:
    return Reader(file, text, read, yaml.safe_load(text), as_yaml)


def _json_reader(file: str, tree: Any, read: Callable[[Path], Any]) -> Reader:
    return Reader(file, as_json(tree), read, tree, as_json)


def _unchecked(bag: Path) -> bytes:
    """Return the bag without checksums and compression, so that damage reaches the reader."""
    from mcap.reader import make_reader
    from mcap.writer import CompressionType, Writer
    out = io.BytesIO()
    writer = Writer(out, compression=CompressionType.NONE, enable_crcs=False)
    with bag.open('rb') as stream:
        reader = make_reader(stream)
        writer.start(reader.get_header().profile, reader.get_header().library)
        channels: dict[int, int] = {}
        schemas: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(
                    schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id],
                    dict(channel.metadata))
            writer.add_message(channels[channel.id], message.log_time, message.data,
                               message.publish_time, message.sequence)
        for metadata in reader.iter_metadata():
            writer.add_metadata(metadata.name, dict(metadata.metadata))
        for item in reader.iter_attachments():
            writer.add_attachment(item.create_time, item.log_time, item.name, item.media_type,
                                  item.data)
    writer.finish()
    return out.getvalue()


def reader(name: str, folder: Path) -> Reader:
    """Return one of `trials.READERS`, with what it needs beside the damaged file in `folder`."""
    if name.startswith('bag'):
        return _bag_reader(name, folder)
    if name == 'csv':
        write_csv(one_recording(), folder / 'run.csv')
        return Reader('run.csv', (folder / 'run.csv').read_bytes(),
                      lambda path: read_csv(path / 'run.csv'))
    if name == 'sheet':
        return _yaml_reader('sheet.yaml', SHEET.encode(),
                            lambda path: load_sheet(path / 'sheet.yaml'))
    if name == 'import_map':
        (folder / 'field.csv').write_text('junk\nt,r,e\n0,1,2\n1,3,4\n')
        return _yaml_reader('map.yaml', MAP.encode(), lambda path: import_file(
            path / 'field.csv', load_map(path / 'map.yaml')))
    if name.startswith('import_'):
        return _table_reader(name, folder)
    if name == 'configuration':
        return _yaml_reader('own.yaml', (config_dir() / 'new_circuit.yaml').read_bytes() + (
            b'axis: {mode_inertias: {value: [2.6e+6, 1.3e+6, 7.5e+5], unit: kg m^2,\n'
            b'  range: [1.0, 1.0e+12], source: fitted}}\n'), lambda path: load(path / 'own.yaml'))
    if name == 'targets':
        return _yaml_reader('targets.yaml', (SHIPPED / 'article.yaml').read_bytes(),
                            lambda path: read_problem(path / 'targets.yaml'))
    if name == 'verdict':
        return _json_reader('verdict.json', VERDICT,
                            lambda path: read_verdict(path / 'verdict.json'))
    if name == 'manifest':
        return _json_reader('manifest.json', MANIFEST, read_manifest)
    if name == 'scored_cases':
        return _json_reader('cases.jsonl', SCORED, lambda path: score(
            read_scored(path / 'cases.jsonl')))
    if name == 'fit_log':
        return Reader('fit.log', FIT_LOG, lambda path: read_log(path / 'fit.log'))
    if name == 'change':
        return _json_reader('change.json', CHANGE, lambda path: read_record(
            (path / 'change.json').read_bytes().decode(errors='replace')))
    assert name == 'frame'
    layout = FrameLayout(OUTPUTS['plant'])
    values = struct.pack('<12d', *range(12))
    return Reader('frame', layout.encode(5.0, 3, 1e-3, 7.0, values),
                  lambda path: _frame(layout, (path / 'frame').read_bytes()))


def _bag_reader(name: str, folder: Path) -> Reader:
    write_bag(one_recording(), folder / 'run')
    bag, metadata = folder / 'run' / 'run_0.mcap', folder / 'run' / 'metadata.yaml'
    if name == 'bag_metadata':
        return _yaml_reader('run/metadata.yaml', metadata.read_bytes(),
                            lambda path: read_bag(path / 'run'))
    if name == 'bag_unchecked':
        content = _unchecked(bag)
        return Reader('run/run_0.mcap', content,
                      lambda path: read_bag(path / 'run' / 'run_0.mcap', partial=True))
    return Reader('run/run_0.mcap', bag.read_bytes(),
                  lambda path: read_bag(path / 'run', partial=name == 'bag_part'))


def _table_reader(name: str, folder: Path) -> Reader:
    """Return the reader of a kind of table, each with the same columns."""
    (folder / 'map.yaml').write_text(MAP)
    columns = {'t': [0.0, 1.0, 2.0], 'r': [1.0, 3.0, 3.0], 'e': [2.0, 4.0, 4.0]}
    records = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    out = io.BytesIO()
    suffix = {'import_lines': 'jsonl'}.get(name, name.removeprefix('import_'))
    if name == 'import_csv':
        out.write(b'junk\nt,r,e\n0,1,2\n1,3,4\n2,3,4\n')
    elif name == 'import_npy':
        np.save(out, np.array([tuple(row.values()) for row in records],
                              [(column, float) for column in columns]))
    elif name == 'import_npz':
        np.savez_compressed(out, **{  # type: ignore[arg-type]
            key: np.array(column) for key, column in columns.items()})
    elif name == 'import_mat':
        savemat(out, columns, do_compression=True)
    elif name == 'import_json':
        out.write(as_json(columns))
    elif name == 'import_lines':
        out.write(b'\n'.join(map(as_json, records)))
    else:
        _write_parquet(out, columns)
    file = f'field.{suffix}'
    tree = columns if name == 'import_json' else None
    return Reader(file, out.getvalue(), lambda path: import_file(
        path / file, load_map(path / 'map.yaml')), tree, as_json if tree else None)


def _write_parquet(out: io.BytesIO, columns: Mapping[str, Any]) -> None:
    import pyarrow
    from pyarrow import parquet
    parquet.write_table(pyarrow.table(dict(columns)), out)


def _frame(layout: FrameLayout, message: bytes) -> tuple[float, ...]:
    from antenna_drive.lockstep.frame import read_foreign
    frame = layout.decode(message)
    return read_foreign(message) if frame is None else frame


def plain(text: bytes) -> Any:
    """Return the plain data of a text of JSON."""
    return json.loads(text)
