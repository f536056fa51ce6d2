# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Sealed truths: written before any recording, with salted hashes that anyone can check.

    DIR/manifest.json            settings of the trial and one hash for each case
    DIR/truth/case_0001.json     the truth with its salt
    DIR/case_0001/               the input of a diagnosis

The salt prevents guessing a truth from its hash. Whoever has the truth file can check it.
"""

from collections.abc import Iterable
import hashlib
import json
import os
from pathlib import Path
import secrets
from typing import Any

from lab.antenna.cases import case_name, Truth
from simgap.errors import UserError

FORMAT = 1
MANIFEST = 'manifest.json'
TRUTHS = 'truth'
SALT_BYTES = 16


class SealError(UserError):
    """A truth or a manifest is missing, unreadable or not the sealed one."""


def seal_of(truth: Truth) -> str:
    """Return the SHA-256 of a salted truth in canonical JSON (keys sorted, no spaces)."""
    text = json.dumps(truth, sort_keys=True, separators=(',', ':'), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def write_whole(path: Path, text: str) -> None:
    """Write a file completely or not at all."""
    draft = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        with open(draft, 'w', encoding='utf-8', newline='') as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)


def seal(folder: Path, settings: dict[str, Any], truths: Iterable[Truth]) -> dict[str, Any]:
    """Write all truths, then the manifest with settings and hashes; return the manifest."""
    (folder / TRUTHS).mkdir(parents=True, exist_ok=True)
    seals = {}
    for truth in truths:
        salted = {**truth, 'salt': secrets.token_hex(SALT_BYTES)}
        write_whole(folder / TRUTHS / f'{truth["case"]}.json',
                    json.dumps(salted, indent=1, allow_nan=False) + '\n')
        seals[truth['case']] = seal_of(salted)
    manifest = {'format': FORMAT, 'settings': settings, 'seals': seals}
    write_whole(folder / MANIFEST, json.dumps(manifest, indent=1) + '\n')
    return manifest


def manifest_seal(manifest: dict[str, Any]) -> str:
    """Return one hash over the whole manifest, to be noted before the trial."""
    return seal_of(manifest)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a trial; SealError where there is none, or the file is not one."""
    path = folder / MANIFEST
    manifest = _read(path, 'make a trial first: lab trial --out DIR')
    if manifest.get('format') != FORMAT or not isinstance(manifest.get('seals'), dict) or (
            not isinstance(manifest.get('settings'), dict)):
        raise SealError(f'{path}: not a manifest of format {FORMAT}; make the trial again')
    names = [case_name(k) for k in range(1, len(manifest['seals']) + 1)]
    if list(manifest['seals']) != names:
        raise SealError(f'{path}: seals: cases are not numbered from {names[:1]} on without gap')
    return manifest


def open_truth(folder: Path, case: str, manifest: dict[str, Any]) -> Truth:
    """Read the truth of a case; SealError where it is missing, unreadable or changed since."""
    path = folder / TRUTHS / f'{case}.json'
    truth = _read(path, 'restore it from where the trial was made')
    if seal_of(truth) != manifest['seals'].get(case) or truth.get('case') != case:
        raise SealError(f'{path}: not the truth that {MANIFEST} sealed; restore the file')
    return truth


def _read(path: Path, remedy: str) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding='utf-8'))
    except FileNotFoundError:
        raise SealError(f'{path}: no such file; {remedy}') from None
    except (OSError, ValueError, RecursionError) as error:
        raise SealError(f'{path}: cannot be read, {error}') from error
    if not isinstance(content, dict):
        raise SealError(f'{path}: not a JSON object; {remedy}')
    return content
