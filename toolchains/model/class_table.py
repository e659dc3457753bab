"""What object classes are made of: one row of soft targets and one weight per class."""

import pathlib
import tomllib
from dataclasses import dataclass

import numpy as np

import materials
from failure import BAD_USAGE, Failure

NYU40_FILE = pathlib.Path(__file__).with_name("nyu40_to_minc23.toml")

# From this share on, the table is taken for the truth when a network is scored.
SURE_SHARE = 0.85


@dataclass
class ClassTable:
    names: list
    targets: np.ndarray  # [classes, 23], rows sum to 1
    weights: np.ndarray  # [classes]

    def truth(self):
        """Per class the material that it is surely made of, else UNKNOWN."""
        sure = (self.targets.max(1) >= SURE_SHARE) & (self.weights > 0)
        return np.where(sure, self.targets.argmax(1), materials.UNKNOWN).astype(np.uint8)


def read_class_table(path):
    try:
        with open(path, "rb") as file:
            rows = tomllib.load(file).get("class", [])
    except OSError as error:
        raise Failure(BAD_USAGE, f"{path}: cannot be read ({error.strerror})") from None
    except tomllib.TOMLDecodeError as error:
        raise Failure(BAD_USAGE, f"{path}: {error}") from None
    if not rows:
        raise Failure(BAD_USAGE, f"{path}: has no [[class]].")
    targets, weights = np.zeros((len(rows), materials.COUNT), np.float32), np.ones(len(rows), np.float32)
    for i, row in enumerate(rows):
        where = f"{path}: class {i} ({row.get('name', 'without a name')})"
        if unknown := set(row) - {"name", "materials", "weight"}:
            raise Failure(BAD_USAGE, f"{where}: there is no key '{sorted(unknown)[0]}'; known are name, materials, weight.")
        for name, share in row.get("materials", {}).items():
            if name not in materials.ID:
                raise Failure(BAD_USAGE, f"{where}: '{name}' is none of the 23 materials.")
            targets[i, materials.ID[name]] = share
        total = targets[i].sum()
        if abs(total - 1) > 1e-3 or targets[i].min() < 0:
            raise Failure(BAD_USAGE, f"{where}: its materials sum to {total:g}, not 1.")
        weights[i] = row.get("weight", 1)
        if not 0 <= weights[i] <= 1:
            raise Failure(BAD_USAGE, f"{where}: its weight {weights[i]:g} is outside 0..1.")
    return ClassTable([row.get("name", "") for row in rows], targets, weights)


def exact_table():
    """For labels that are material ids already."""
    return ClassTable(list(materials.NAMES), np.eye(materials.COUNT, dtype=np.float32), np.ones(materials.COUNT, np.float32))
