"""The network that ships: MobileNetV2 with a DeepLabV3+ decoder, started from the public ADE20K weights.

What is changed against the original, and why:
 - no concatenation: a 1x1 convolution over joined channels is the sum of one over each part, and a depthwise one splits
   by channel. Exact, and the sum needs no requantised copies;
 - the decoder runs at stride 8, not 4: a quarter of its 1.3 x 10^9 multiply-adds at 480x272 for edges that the map
   (1 cm cells) and the fusion over many views cannot use;
 - the last layer scores 23 materials, not 32 objects.
"""

from dataclasses import replace

import numpy as np

import materials
from failure import BAD_INPUT, Failure
from graph import Graph, Op


def _expect(condition, what):
    if not condition:
        raise Failure(BAD_INPUT, f"The starting network is not a DeepLabV3+ MobileNetV2 as expected: {what}.")


class _Source:
    """The original's operators, found by what they read."""

    def __init__(self, graph):
        self.ops = graph.ops
        self.users = {}
        for op in graph.ops:
            for name in op.inputs:
                self.users.setdefault(name, []).append(op)

    def user(self, name, kind):
        """The one operator of this kind that reads a tensor."""
        found = [op for op in self.users.get(name, []) if op.kind == kind]
        _expect(len(found) == 1, f"{len(found)} {kind} operators read {name}")
        return found[0]


class _Target:
    """The new network, operator by operator; `names` maps the original's tensors to ours."""

    def __init__(self):
        self.ops, self.names = [], {"image": "image"}

    def put(self, op, name, inputs, **changes):
        self.ops.append(replace(op, output=name, inputs=tuple(inputs), **changes))
        self.names[op.output] = name
        return name


def _input_part(op, first, count, with_bias):
    """The part of a 1x1 convolution over joined channels that sees `count` of them; its sum is activated, not it."""
    return replace(op, weight=op.weight[..., first:first + count], bias=op.bias if with_bias else None, activation="none")


def _channel_part(op, first, count):
    """The part of a depthwise convolution that has `count` of its channels."""
    return replace(op, weight=op.weight[..., first:first + count], bias=op.bias[first:first + count])


def from_deeplab(graph, rng, decoder_stride=8):
    """The Graph to train. `graph`: the ADE20K network as read_tflite gives it. `decoder_stride` 4 is the original's
    arithmetic (a test compares the two), 8 is ours."""
    source, target = _Source(graph), _Target()
    put = target.put
    concats = [op for op in source.ops if op.kind == "concat"]
    _expect(len(concats) == 2, "it has not two concatenations")
    image_mean = next((op for op in source.ops if op.kind == "average_pool" and op.window == 0), None)
    _expect(image_mean is not None, "it has no image-level pooling")

    # The backbone: everything before the image-level pooling, named by position.
    number = 0
    for op in source.ops[: source.ops.index(image_mean)]:
        if op.kind == "quantize":
            target.names[op.output] = target.names[op.inputs[0]]
            continue
        put(op, f"backbone{number:02d}_{op.kind}", [target.names[name] for name in op.inputs])
        number += 1
    top = target.names[image_mean.inputs[0]]
    backbone = set(target.names)

    # Context: the image's mean and each place's own features, joined by a 1x1 convolution.
    image_conv, local_conv = source.user(image_mean.output, "conv"), source.user(image_mean.inputs[0], "conv")
    join = source.user(concats[0].output, "conv")
    image_channels, local_channels = image_conv.weight.shape[0], local_conv.weight.shape[0]
    image = put(image_conv, "context_image", [put(image_mean, "image_mean", [top], kind="mean", window=1)])
    local = put(local_conv, "context_local", [top])
    from_image = put(_input_part(join, 0, image_channels, True), "join_image", [image])
    from_local = put(_input_part(join, image_channels, local_channels, False), "join_local", [local])
    context = put(Op("add", "join", ()), "context", [from_local, from_image], activation=join.activation)

    # Detail: early features of the backbone, with fewer channels, at the decoder's stride.
    detail_conv = next((op for op in source.ops if op.kind == "conv" and op.inputs[0] in backbone and
                        op.output not in backbone and op.inputs[0] != image_mean.inputs[0]), None)
    _expect(detail_conv is not None, "its decoder reads no early features")
    detail = put(detail_conv, "detail", [target.names[detail_conv.inputs[0]]])
    if decoder_stride == 8:
        detail = put(Op("average_pool", "detail_half", (), window=2), "detail_half", [detail])

    # Decoder: the same split at the second concatenation.
    depthwise = source.user(concats[1].output, "depthwise")
    pointwise = source.user(depthwise.output, "conv")
    context_channels, detail_channels = join.weight.shape[0], detail_conv.weight.shape[0]
    enlarged = put(Op("resize", "enlarged", (), size_like=detail, half_pixel_centers=decoder_stride == 8),
                   "context_enlarged", [context])
    d0 = put(_channel_part(depthwise, 0, context_channels), "decode0_context", [enlarged])
    d1 = put(_channel_part(depthwise, context_channels, detail_channels), "decode0_detail", [detail])
    p0 = put(_input_part(pointwise, 0, context_channels, True), "decode1_context", [d0])
    p1 = put(_input_part(pointwise, context_channels, detail_channels, False), "decode1_detail", [d1])
    decoded = put(Op("add", "decoded", ()), "decode1", [p0, p1], activation=pointwise.activation)
    depthwise = source.user(pointwise.output, "depthwise")
    pointwise = source.user(depthwise.output, "conv")
    features = put(pointwise, "decode3", [put(depthwise, "decode2", [decoded])])

    # The new last layer starts as noise of the old one's size.
    classes = source.user(pointwise.output, "conv")
    shape = (materials.COUNT, 1, 1, classes.weight.shape[3])
    noise = rng.normal(0, np.abs(classes.weight).mean(), shape).astype(np.float32)
    put(classes, "scores", [features], weight=noise, bias=np.zeros(materials.COUNT, np.float32))
    return Graph(target.ops, "scores")


def with_original_scores(graph, source):
    """The same network with the original's last layer: what shows that the import kept its weights."""
    classes = [op for op in source.ops if op.kind == "conv"][-1]
    ops = [replace(op, weight=classes.weight, bias=classes.bias) if op.output == "scores" else op for op in graph.ops]
    return Graph(ops, "scores")
