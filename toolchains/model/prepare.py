"""Reads every source once, checks it, and writes it in the form that training maps into memory."""

import json

import numpy as np
from PIL import Image

from failure import BAD_INPUT, Failure
from sources import read_picture

# Pictures are kept at most this wide: training zooms in up to 1.8 times from 480, and beyond 640 nothing is gained.
WIDTH_MAX = 640


def prepare(sources, out):
    out.mkdir(parents=True, exist_ok=True)
    summary = []
    for source in sources:
        if not source.pictures:
            raise Failure(BAD_INPUT, f"{source.name}: has no labelled pictures.")
        image, _ = read_picture(source.pictures[0], source.table)
        height, width = image.shape[:2]
        if width > WIDTH_MAX:
            height, width = round(height * WIDTH_MAX / width), WIDTH_MAX
        shape = (len(source.pictures), height, width)
        images = np.lib.format.open_memmap(out / f"{source.name}.images.npy", "w+", np.uint8, (*shape, 3))
        labels = np.lib.format.open_memmap(out / f"{source.name}.labels.npy", "w+", np.uint8, shape)
        counts = np.zeros(len(source.table.names), np.int64)
        for i, picture in enumerate(source.pictures):
            image, label = read_picture(picture, source.table)
            if image.shape[:2] != (height, width):
                image = np.asarray(Image.fromarray(image).resize((width, height), Image.BILINEAR))
                label = np.asarray(Image.fromarray(label).resize((width, height), Image.NEAREST))
            images[i], labels[i] = image, label
            counts += np.bincount(label.ravel(), minlength=256)[: len(counts)]
        description = {
            "name": source.name,
            "classes": source.table.names,
            "targets": source.table.targets.tolist(),
            "weights": source.table.weights.tolist(),
            "truth": source.table.truth().tolist(),
            "pixels": counts.tolist(),
            "pictures": [{"file": p.label.name, "scene": p.scene, "part": p.part} for p in source.pictures],
        }
        (out / f"{source.name}.json").write_text(json.dumps(description))
        parts = [p.part for p in source.pictures]
        summary.append(f"{source.name}: {len(parts)} pictures of {width}x{height}, " +
                       ", ".join(f"{parts.count(part)} {part}" for part in dict.fromkeys(parts)))
    return summary
