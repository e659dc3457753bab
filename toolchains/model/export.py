"""Writes what the program reads: the .tflite file and its class map."""

from dataclasses import replace

import materials
from failure import BAD_INPUT, Failure
from tflite_write import tflite_bytes
from train import MEAN, STD

# The program carries the file inside itself.
FILE_BYTES_MAX = 4_000_000


def class_map(name, temperature, ece_before, ece_after):
    lines = [
        "# The network trained for tactus (tactus_materials.md): its classes are the 23 materials themselves.",
        "# Written by toolchains/model/tactus_model.py export.",
        "",
        "[network]",
        f'name = "{name}"',
        f"# Fitted on held-out pictures: expected calibration error {ece_before:.3f} before, {ece_after:.3f} after.",
        f"temperature = {temperature:.3f}",
        "",
        "[input]",
        'order = "rgb"',
        f"mean = [{MEAN}, {MEAN}, {MEAN}]",
        f"std = [{STD}, {STD}, {STD}]",
        "",
    ]
    for material in materials.NAMES:
        lines += ["[[class]]", f'name = "{material}"', f"materials = {{ {material} = 1.0 }}"]
    return "\n".join(lines) + "\n"


def export(graph, size, out, temperature, ece, is_float=False):
    """(bytes written, multiply-adds). `is_float`: float32 weights, to see what int8 costs; not for shipping."""
    width, height = size
    if is_float:
        graph = replace(graph, ranges={})
    data = tflite_bytes(graph, height, width, f"tactus materials, 23 MINC classes, {width}x{height}")
    if len(data) > FILE_BYTES_MAX and not is_float:
        raise Failure(BAD_INPUT, f"{out}: would take {len(data)} bytes, more than the {FILE_BYTES_MAX} that may ship.")
    out.write_bytes(data)
    out.with_suffix(".toml").write_text(class_map(out.stem, temperature, *ece))
    return len(data), graph.multiply_adds(height, width)
