"""Cache of results on disk, so that an interrupted study continues where it stopped."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..model.grid import Array

NO_ARRAY = np.empty(0)


@functools.cache
def _fingerprint() -> str:
    """Return a hash of the code that results depend on."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for folder in ('scene', 'model', 'live', 'tradeoff'):
        for path in sorted((package / folder).rglob('*.py')):
            digest.update(path.read_bytes())
    return digest.hexdigest()


class Cache:
    """
    Results on disk, addressed by a key.

    The key names scene, setting, machine and versions; the code belongs to it as well.  A result
    for which any of these has changed is not found.

    Parameters
    ----------
    folder
        Created if it does not exist.

    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def _path(self, key: Mapping[str, Any]) -> Path:
        text = json.dumps([_fingerprint(), key], sort_keys=True, default=list)
        return self._folder / hashlib.sha256(text.encode()).hexdigest()[:20]

    def load(self, key: Mapping[str, Any]) -> tuple[Any, Array] | None:
        """Return the result for a key and its array; None if there is none or it is damaged."""
        path = self._path(key)
        try:
            result = json.loads(path.with_suffix('.json').read_text())['result']
            with path.with_suffix('.npy').open('rb') as file:
                array: Array = np.load(file, allow_pickle=False)
        except (OSError, ValueError, KeyError, TypeError, EOFError):
            return None
        return result, array

    def save(self, key: Mapping[str, Any], result: Any, array: Array = NO_ARRAY) -> None:
        """Write a result that `json` can represent, and an array; each file is replaced whole."""
        path = self._path(key)
        draft = path.with_suffix('.part')
        with draft.open('wb') as file:
            np.save(file, array, allow_pickle=False)
        os.replace(draft, path.with_suffix('.npy'))
        draft.write_text(json.dumps({'result': result}))
        os.replace(draft, path.with_suffix('.json'))
