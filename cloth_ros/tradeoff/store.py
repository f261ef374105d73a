"""What has been measured already, so that an interrupted study goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..model.lattice import Array


class Store:
    """
    Results by what they are results of.

    A result belongs to the scene, the setting, the machine and the versions that it was measured
    with; what any of them has changed is measured anew.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def _path(self, key: Mapping[str, Any]) -> Path:
        text = json.dumps(key, sort_keys=True, default=list)
        return self._folder / hashlib.sha256(text.encode()).hexdigest()[:20]

    def load(self, key: Mapping[str, Any]) -> dict[str, Any] | None:
        """Return the result for a key, or None if there is none that can be read."""
        try:
            record: dict[str, Any] = json.loads(self._path(key).with_suffix('.json').read_text())
        except (OSError, ValueError):
            return None
        return record

    def save(self, key: Mapping[str, Any], record: Mapping[str, Any]) -> None:
        """Keep a result; it is there as a whole or not at all."""
        path = self._path(key).with_suffix('.json')
        draft = path.with_suffix('.part')
        draft.write_text(json.dumps(record))
        os.replace(draft, path)

    def load_array(self, key: Mapping[str, Any]) -> Array | None:
        """Return the array for a key, or None if there is none that can be read."""
        try:
            with self._path(key).with_suffix('.npy').open('rb') as file:
                array: Array = np.load(file, allow_pickle=False)
        except (OSError, ValueError):
            return None
        return array

    def save_array(self, key: Mapping[str, Any], array: Array) -> None:
        """Keep an array; it is there as a whole or not at all."""
        path = self._path(key).with_suffix('.npy')
        draft = path.with_suffix('.part')
        with draft.open('wb') as file:
            np.save(file, array, allow_pickle=False)
        os.replace(draft, path)
