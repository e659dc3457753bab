"""The network that ships: MobileNetV2 with a DeepLabV3+ decoder, started from the public ADE20K weights.

What is changed against the original, and why:
 - no concatenation: a 1x1 convolution over joined channels is the sum of one over each part, and a depthwise one splits
   by channel. Exact, and the sum needs no requantised copies;
 - the decoder runs at stride 8, not 4: a quarter of its 4.7 x 10^9 multiply-adds at 480x272 for edges that the map
   (1 cm cells) and the fusion over many views cannot use;
 - the last layer scores 23 materials, not 32 objects.
"""

from dataclasses import replace

import numpy as np

from failure import BAD_INPUT, Failure
from graph import Graph, Op

MATERIALS_COUNT = 23


class _Chain:
    """Operators of the original by position, renamed as they are copied."""

    def __init__(self, source):
        self.by_output = {op.output: op for op in source.ops}
        self.ops = list(source.ops)
        self.users = {}
        for op in source.ops:
            for name in op.inputs:
                self.users.setdefault(name, []).append(op)


def _expect(condition, what):
    if not condition:
        raise Failure(BAD_INPUT, f"The starting network is not a DeepLabV3+ MobileNetV2 as expected: {what}.")


def _split(op, channels_before, channels, bias):
    """The part of a convolution after a concatenation that sees `channels` from `channels_before` on."""
    part = slice(channels_before, channels_before + channels)
    return replace(op, weight=op.weight[..., part], bias=op.bias if bias else None)


def from_deeplab(source, rng, decoder_stride=8):
    """The Graph to train. `source`: the ADE20K network as read_tflite gives it."""
    chain = _Chain(source)
    concats = [op for op in chain.ops if op.kind == "concat"]
    _expect(len(concats) == 2, "it has not two concatenations")
    image_pool = next((op for op in chain.ops if op.kind == "average_pool" and op.window == 0), None)
    _expect(image_pool is not None, "it has no image-level pooling")

    new, names = [], {"image": "image"}

    def put(op, name, inputs, **changes):
        new.append(replace(op, output=name, inputs=tuple(inputs), **changes))
        names[op.output] = name
        return name

    # The backbone: everything before the image-level pooling, names by position.
    number = 0
    for op in chain.ops[: chain.ops.index(image_pool)]:
        if op.kind == "quantize":
            names[op.output] = names[op.inputs[0]]
            continue
        put(op, f"backbone{number:02d}_{op.kind}", [names[name] for name in op.inputs])
        number += 1
    top = names[image_pool.inputs[0]]

    def only_user(name, kind):
        users = [op for op in chain.users.get(name, []) if op.kind == kind]
        _expect(len(users) == 1, f"{len(users)} {kind} operators read {name}")
        return users[0]

    # Context: the image's mean and each place's own features, joined by a 1x1 convolution.
    pool_conv = only_user(image_pool.output, "conv")
    aspp = next(op for op in chain.users[image_pool.inputs[0]] if op.kind == "conv")
    join = only_user(concats[0].output, "conv")
    pool_channels = pool_conv.weight.shape[0]
    mean = put(replace(image_pool, kind="mean"), "image_mean", [top])
    pooled = put(pool_conv, "context_image", [mean])
    local = put(aspp, "context_local", [top])
    a = put(_split(join, 0, pool_channels, True), "join_image", [pooled], activation="none")
    b = put(_split(join, pool_channels, aspp.weight.shape[0], False), "join_local", [local], activation="none")
    context = put(Op("add", "join", ()), "context", [b, a], activation=join.activation)

    # Decoder: the same split at the second concatenation, context enlarged to the decoder's stride.
    low_conv = next(op for op in chain.ops if op.kind == "conv" and op.inputs[0] in names and
                    names[op.inputs[0]].startswith("backbone") and op.output not in names and op is not aspp)
    depthwise = only_user(concats[1].output, "depthwise")
    pointwise = only_user(depthwise.output, "conv")
    channels = concats[0].output and join.weight.shape[0]
    low = put(low_conv, "detail", [names[low_conv.inputs[0]]])
    if decoder_stride == 8:
        low = put(Op("average_pool", "detail_half", (), window=2), "detail_half", [low])
    enlarged = put(Op("resize", "enlarged", (), size_like=low, half_pixel_centers=True), "context_enlarged", [context])
    low_channels = low_conv.weight.shape[0]

    def half(op, first, count, bias_part):
        return replace(op, weight=op.weight[..., first:first + count], bias=op.bias[first:first + count] if bias_part else op.bias)

    d0 = put(half(depthwise, 0, channels, True), "decode0_context", [enlarged])
    d1 = put(half(depthwise, channels, low_channels, True), "decode0_detail", [low])
    p0 = put(_split(pointwise, 0, channels, True), "decode1_context", [d0], activation="none")
    p1 = put(_split(pointwise, channels, low_channels, False), "decode1_detail", [d1], activation="none")
    decoded = put(Op("add", "decoded", ()), "decode1", [p0, p1], activation=pointwise.activation)
    depthwise2 = only_user(pointwise.output, "depthwise")
    pointwise2 = only_user(depthwise2.output, "conv")
    d2 = put(depthwise2, "decode2", [decoded])
    features = put(pointwise2, "decode3", [d2])
    classes = only_user(pointwise2.output, "conv")
    scale = np.abs(classes.weight).mean()
    put(replace(classes, weight=rng.normal(0, scale, (MATERIALS_COUNT, 1, 1, classes.weight.shape[3])).astype(np.float32),
                bias=np.zeros(MATERIALS_COUNT, np.float32)), "scores", [features])
    return Graph(new, "scores")


def with_original_scores(graph, source):
    """The same network with the original's last layer: what proves that the import kept its weights."""
    pooled = [op for op in source.ops if op.kind == "conv"][-1]
    ops = [replace(op, weight=pooled.weight, bias=pooled.bias) if op.output == "scores" else op for op in graph.ops]
    return Graph(ops, "scores")
