"""A network as a list of operators, which everything here shares: the reader and the writer of .tflite files, the
float network that torch trains, and the int8 simulator."""

from dataclasses import dataclass, field, replace

import numpy as np

KINDS = ("conv", "depthwise", "add", "average_pool", "mean", "resize", "concat", "quantize", "arg_max")


@dataclass(frozen=True)
class Op:
    """One operator; `output` names it and the tensor that it computes.

    weight   conv: [out, height, width, in]; depthwise: [1, height, width, channels] (the layouts of the .tflite format)
    bias     one per output channel, or None
    size     resize: (height, width) of the result, or None for "as the tensor `size_like`"
    """

    kind: str
    output: str
    inputs: tuple
    weight: np.ndarray | None = None
    bias: np.ndarray | None = None
    stride: int = 1
    dilation: int = 1
    window: int = 1               # average_pool: rows and columns, stride as large; 0: the whole image
    activation: str = "none"      # none, relu or relu6
    size_like: str | None = None  # resize: this tensor's height and width
    half_pixel_centers: bool = False
    align_corners: bool = False


@dataclass
class Graph:
    """Operators in an order in which they can run. The image is the tensor `input`, 3 channels."""

    ops: list
    scores: str
    # Per tensor what an 8-bit file says about it: (scale, zero point). Empty for a float network.
    ranges: dict = field(default_factory=dict)
    input: str = "image"

    def op(self, name):
        return next(op for op in self.ops if op.output == name)

    def up_to(self, scores):
        """The part that leads to the tensor `scores`."""
        needed, kept = {scores}, []
        for op in reversed(self.ops):
            if op.output in needed:
                kept.append(op)
                needed.update(op.inputs)
                if op.size_like:
                    needed.add(op.size_like)
        return replace(self, ops=kept[::-1], scores=scores)

    def shapes(self, height, width):
        """Per tensor (height, width, channels) for an image of this size."""
        shapes = {self.input: (height, width, 3)}
        for op in self.ops:
            h, w, c = shapes[op.inputs[0]]
            if op.kind == "conv":
                h, w, c = -(-h // op.stride), -(-w // op.stride), op.weight.shape[0]
            elif op.kind == "depthwise":
                h, w = -(-h // op.stride), -(-w // op.stride)
            elif op.kind == "average_pool" and op.window:
                h, w = -(-h // op.window), -(-w // op.window)
            elif op.kind in ("mean", "average_pool"):
                h, w = 1, 1
            elif op.kind == "resize":
                h, w = shapes[op.size_like][:2]
            elif op.kind == "concat":
                c = sum(shapes[name][2] for name in op.inputs)
            elif op.kind == "add":
                h, w = max(shapes[n][0] for n in op.inputs), max(shapes[n][1] for n in op.inputs)
            shapes[op.output] = (h, w, c)
        return shapes

    def multiply_adds(self, height, width):
        """Of the convolutions, which are all that counts."""
        shapes = self.shapes(height, width)
        return sum(shapes[op.output][0] * shapes[op.output][1] * op.weight.size
                   for op in self.ops if op.kind in ("conv", "depthwise"))

    def parameters(self):
        return sum(op.weight.size + (0 if op.bias is None else op.bias.size) for op in self.ops if op.weight is not None)


def same_margins(length, window, stride, dilation=1):
    """(before, after): what "same" padding adds along one axis; the odd one goes to the end."""
    reach = (window - 1) * dilation + 1
    total = max((-(-length // stride) - 1) * stride + reach - length, 0)
    return total // 2, total - total // 2
