"""Scores a network on test pictures through the program's own int8 path (tests/bench/network_accuracy)."""

import json
import pathlib
import subprocess
import tempfile

import numpy as np
from PIL import Image

import materials
import sources
from failure import BAD_INPUT, BAD_USAGE, Failure

HELD_OUT = ("bedroom_rendered", "nyuv2", "hand_labels", "rooms_rendered")


def _labelled_recording(folder, every):
    images = {p.stem: p for p in (folder / "rgb").iterdir()}
    return [(images[p.stem], p) for p in sorted((folder / "label").glob("*.png"))[::every] if p.stem in images]


def _hand_labels(data):
    """Frames labelled by hand beside the recordings that they belong to."""
    pairs = []
    for scene, recording in (("kitchen", "kitchen_7scenes"), ("office", "tum_fr1_rpy")):
        files = {p.stem: p for p in (data / recording).rglob("*") if p.suffix in (".jpg", ".png") and "depth" not in str(p.name)
                 and p.parent.name != "depth"}
        for label in sorted((data / "hand_labels" / scene).glob("*.png")):
            image = files.get(label.stem) or files.get(f"{label.stem}.color")
            if image is None:
                raise Failure(BAD_INPUT, f"{label}: no colour frame of its name is in {data / recording}.")
            pairs.append((image, label))
    return pairs


def _with_material_truth(source, folder):
    """Object labels as material truth, where the class table is sure; written to `folder`."""
    lookup = np.full(256, materials.UNKNOWN, np.uint8)
    lookup[: len(source.table.names)] = source.table.truth()
    pairs = []
    for picture in source.pictures:
        _, label = sources.read_picture(picture, source.table)
        to = folder / f"{source.name}_{picture.label.stem}.png"
        Image.fromarray(lookup[label]).save(to)
        pairs.append((picture.image, to))
    return pairs


def pairs_of(name, data, folder, hold_out):
    if not (data / name).is_dir():
        raise Failure(BAD_INPUT, f"{data / name}: there is no such folder.")
    if name == "nyuv2":
        return _with_material_truth(sources.nyuv2(data / name, sources.TEST), folder)
    if name == "hand_labels":
        return _hand_labels(data)
    if name == "rooms_rendered":
        source = sources.rendered_rooms(data / name, hold_out)
        return [(p.image, p.label) for p in source.pictures if p.part == sources.VALIDATION]
    return _labelled_recording(data / name, 12)


def evaluate(options):
    tool = options.tool
    if not tool.is_file():
        raise Failure(BAD_USAGE, f"{tool}: is not there; build the target network_accuracy.")
    results = {}
    with tempfile.TemporaryDirectory(prefix="tactus_evaluate_") as temporary:
        folder = pathlib.Path(temporary)
        for name in options.set or HELD_OUT:
            pairs = pairs_of(name, options.data, folder, options.hold_out)
            listing = folder / f"{name}.txt"
            listing.write_text("".join(f"{image}\t{label}\n" for image, label in pairs))
            more = ["--predictions", str(options.predictions / name)] if options.predictions else []
            done = subprocess.run([str(tool), str(options.model), str(options.map), str(listing), *more],
                                  capture_output=True, text=True)
            if done.returncode != 0:
                raise Failure(done.returncode, done.stderr.strip())
            results[name] = json.loads(done.stdout)
    return results


def table(results):
    lines = ["| pictures of | n | pixel accuracy | mean accuracy | mean IU | f.w. IU | ECE | ms |", "|---|---|---|---|---|---|---|---|"]
    for name, r in results.items():
        lines.append(f"| {name} | {r['pictures']} | {100 * r['pixel_accuracy']:.1f} | {100 * r['mean_accuracy']:.1f} | "
                     f"{100 * r['mean_iu']:.1f} | {100 * r['frequency_weighted_iu']:.1f} | "
                     f"{r['expected_calibration_error']:.3f} | {r['processor_ms_p50']:.0f} |")
    return "\n".join(lines)


def per_class(results):
    lines = []
    for name, r in results.items():
        lines.append(f"{name}, IU in % (share in %): " + ", ".join(
            f"{material} {100 * c['iu']:.0f} ({100 * c['share']:.1f})"
            for material, c in sorted(r["classes"].items(), key=lambda item: -item[1]["share"])))
    return "\n".join(lines)
