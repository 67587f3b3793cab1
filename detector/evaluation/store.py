"""Results on disk, one small file each, so that an interrupted evaluation goes on where it stopped."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from recordings import Array, BadInput


@dataclass(frozen=True)
class Store:
    """A folder of results of one plan. Files are written whole or not at all; one that cannot be read is made anew."""

    folder: Path

    @classmethod
    def at(cls, out: Path, key: str) -> Store:
        """In ``out/work/key``. Raises BadInput when it cannot be made."""
        folder = out / "work" / key
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInput(str(out), f"it cannot be made ({error.strerror})", "give a folder to write in") from None
        return cls(folder)

    def result(self, name: str) -> Any | None:
        """What was kept under a name; None when nothing is there."""
        try:
            return json.loads((self.folder / f"{name}.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None

    def keep(self, name: str, value: Any) -> None:
        """Keep a result."""
        self._written(f"{name}.json", lambda part: part.write_text(json.dumps(value), encoding="utf-8"))

    def run(self, name: str, make: Callable[[], Array]) -> Array:
        """The run kept under a name, made first when it is not there; single precision, as a transmitter's."""
        path = self.folder / f"{name}.npy"
        try:
            return np.asarray(np.load(path), np.float64)
        except (OSError, ValueError):
            made = make().astype(np.float32)
        self._written(f"{name}.npy", lambda part: np.save(part, made))
        return np.asarray(made, np.float64)

    def _written(self, name: str, write: Callable[[Path], object]) -> None:
        # The suffix stays last: numpy would add its own.
        part = self.folder / f".{os.getpid()}.{name}"
        try:
            write(part)
            part.replace(self.folder / name)
        except OSError as error:
            raise BadInput(str(self.folder), f"it cannot be written ({error.strerror})", "free it, go on") from None
