"""A Graph as a torch module: float for training, or with the rounding of int8 in it (for quantisation-aware training and
for choosing scales). Rounding goes through `straight_through`: its gradient is that of the identity."""

import dataclasses

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

from graph import Graph, same_margins


def straight_through(rounded, real):
    return real + (rounded - real).detach()


def fake_quantize(x, scale, zero, low=-128, high=127):
    """x as int8 would hold it; gradients stop where it is clipped."""
    clipped = x.clamp((low - zero) * scale, (high - zero) * scale)
    return straight_through(torch.round(clipped / scale) * scale, clipped)


def fake_quantize_weight(weight):
    """Symmetric, one scale per output channel (dimension 0)."""
    scale = weight.detach().abs().flatten(1).amax(1).clamp_min(1e-8).view(-1, 1, 1, 1) / 127
    return straight_through(torch.round(weight / scale) * scale, weight)


class Net(nn.Module):
    """Weights are kept as (size per output channel) x (direction of size one): with batch norms folded, channels
    differ a thousandfold in size, and one learning rate has to serve them all."""

    def __init__(self, graph):
        super().__init__()
        self.graph = graph
        self.weights, self.biases = nn.ParameterDict(), nn.ParameterDict()
        for op in graph.ops:
            if op.weight is None:
                continue
            w = torch.from_numpy(np.ascontiguousarray(op.weight, dtype=np.float32))
            # torch's layouts: [out, in, h, w]; depthwise [channels, 1, h, w].
            w = w.permute(3, 0, 1, 2) if op.kind == "depthwise" else w.permute(0, 3, 1, 2)
            size = w.flatten(1).pow(2).mean(1).sqrt().clamp_min(1e-4).view(-1, 1, 1, 1)
            self.register_buffer(f"size_{op.output}", size)
            self.weights[op.output] = nn.Parameter((w / size).contiguous(memory_format=torch.channels_last))
            if op.bias is not None:
                self.biases[op.output] = nn.Parameter(torch.from_numpy(np.array(op.bias, dtype=np.float32)))
        self.ranges = None  # per tensor (scale, zero point); None: float

    def weight(self, op):
        w = self.weights[op.output] * getattr(self, f"size_{op.output}")
        return w if self.ranges is None else fake_quantize_weight(w)

    def _convolve(self, op, x):
        w = self.weight(op)
        vertical = same_margins(x.shape[2], w.shape[2], op.stride, op.dilation)
        horizontal = same_margins(x.shape[3], w.shape[3], op.stride, op.dilation)
        if vertical[0] == vertical[1] and horizontal[0] == horizontal[1]:
            padding = (vertical[0], horizontal[0])
        else:
            x, padding = F.pad(x, (*horizontal, *vertical)), 0
        bias = self.biases[op.output] if op.bias is not None else None
        return F.conv2d(x, w, bias, op.stride, padding, op.dilation, w.shape[0] if op.kind == "depthwise" else 1)

    def _run(self, op, t):
        x = t[op.inputs[0]]
        if op.kind in ("conv", "depthwise"):
            return self._convolve(op, x)
        if op.kind == "add":
            return x + t[op.inputs[1]]
        if op.kind == "average_pool" and op.window:
            return F.avg_pool2d(x, op.window)
        if op.kind in ("average_pool", "mean"):
            return x.mean((2, 3), keepdim=True)
        if op.kind == "resize":
            size = t[op.size_like].shape[2:]
            if tuple(x.shape[2:]) == (1, 1):
                return x.expand(-1, -1, *size)
            if not op.half_pixel_centers and not op.align_corners:
                return _resize_legacy(x, size)
            return F.interpolate(x, size=size, mode="bilinear", align_corners=op.align_corners)
        if op.kind == "concat":
            return torch.cat([t[name] for name in op.inputs], 1)
        if op.kind == "quantize":
            return x
        if op.kind == "arg_max":
            return x.argmax(1)
        raise AssertionError(op.kind)

    def compute(self, op, t):
        """The result of one operator from the tensors `t` that it reads."""
        y = self._run(op, t)
        if op.activation != "none":
            y = F.relu6(y) if op.activation == "relu6" else F.relu(y)
        return self._quantized(op.output, y)

    def tensors(self, image, frozen=()):
        """Every tensor by name. Operators in `frozen` run without gradients."""
        t = {self.graph.input: self._quantized(self.graph.input, image)}
        for op in self.graph.ops:
            with torch.set_grad_enabled(torch.is_grad_enabled() and op.output not in frozen):
                t[op.output] = self.compute(op, t)
        return t

    def _quantized(self, name, y):
        return y if self.ranges is None or name not in self.ranges else fake_quantize(y, *self.ranges[name])

    def forward(self, image, frozen=()):
        return self.tensors(image, frozen)[self.graph.scores]

    def to_graph(self):
        """The Graph with the weights as they are now."""
        ops = []
        for op in self.graph.ops:
            if op.weight is not None:
                w = (self.weights[op.output] * getattr(self, f"size_{op.output}")).detach().cpu()
                w = w.permute(1, 2, 3, 0) if op.kind == "depthwise" else w.permute(0, 2, 3, 1)
                bias = None if op.bias is None else self.biases[op.output].detach().cpu().numpy()
                op = dataclasses.replace(op, weight=np.ascontiguousarray(w.numpy()), bias=bias)
            ops.append(op)
        return Graph(ops, self.graph.scores, dict(self.ranges or {}), self.graph.input)


def _resize_legacy(x, size):
    """Bilinear as the format's older files mean it: result pixel i looks at i * ratio (neither corners nor centres
    agree)."""
    for dim, length in ((2, size[0]), (3, size[1])):
        n = x.shape[dim]
        at = torch.arange(length, device=x.device, dtype=torch.float32) * (n / length)
        first = at.floor().long().clamp_max(n - 1)
        blend = (at - first).view([-1 if d == dim else 1 for d in range(4)])
        second = (first + 1).clamp_max(n - 1)
        x = x.index_select(dim, first) * (1 - blend) + x.index_select(dim, second) * blend
    return x
