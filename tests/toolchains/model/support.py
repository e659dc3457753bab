"""What the tests of toolchains/model share."""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "toolchains/model"))

import numpy as np  # noqa: E402

from graph import Graph, Op  # noqa: E402


def absent(*modules):
    """A sentence when one of the modules is not installed, else None (for unittest.skipIf)."""
    for module in modules:
        try:
            __import__(module)
        except ImportError:
            return f"python3-{module} is not installed"
    return None


def small_graph(rng, classes=23):
    """Every kind of operator that the exporter knows, at stride 1 in the end, with int8 ranges that fit."""

    def conv(name, source, out, channels, window=1, **more):
        weight = rng.normal(0, 1 / (window * channels**0.5), (out, window, window, channels))
        return Op("conv", name, (source,), weight.astype(np.float32), rng.normal(0, 0.1, out).astype(np.float32), **more)

    def depthwise(name, source, channels, **more):
        return Op("depthwise", name, (source,), rng.normal(0, 0.4, (1, 3, 3, channels)).astype(np.float32),
                  rng.normal(0, 0.1, channels).astype(np.float32), **more)

    ops = [
        conv("first", "image", 8, 3, 3, activation="relu6"),
        depthwise("halved", "first", 8, stride=2, activation="relu6"),
        depthwise("dilated", "halved", 8, dilation=2),
        Op("add", "sum", ("dilated", "halved"), activation="relu"),
        Op("average_pool", "pooled", ("sum",), window=2),
        Op("mean", "image_mean", ("pooled",)),
        conv("context", "image_mean", 8, 8),
        Op("add", "joined", ("pooled", "context")),
        Op("resize", "enlarged", ("joined",), size_like="first", half_pixel_centers=True),
        Op("add", "both", ("first", "enlarged")),
        conv("scores", "both", classes, 8),
    ]
    six, wide = (6 / 255, -128), (8 / 255, 0)
    ranges = {"image": (1 / 127.5, -1), "first": six, "halved": six, "dilated": wide, "sum": (8 / 255, -128),
              "pooled": (8 / 255, -128), "image_mean": (4 / 255, -128), "context": (4 / 255, 3), "joined": (12 / 255, -20),
              "enlarged": (12 / 255, -20), "both": (16 / 255, -20), "scores": (12 / 255, 5)}
    return Graph(ops, "scores", {name: (np.float32(s).item(), z) for name, (s, z) in ranges.items()})
