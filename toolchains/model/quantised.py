"""8-bit arithmetic as the program's kernels do it, in numpy: how weights and biases are rounded, and an oracle that runs
a whole Graph in integers. Slow and plain; the int8 simulator in torch_net.py is checked against it."""

import numpy as np

from graph import same_margins

LOW, HIGH = -128, 127


def quantize_weight(weight, dimension):
    """(int8 values, float32 scales): symmetric, one scale per slice of `dimension`, -127..127."""
    largest = np.abs(weight).max(axis=tuple(d for d in range(weight.ndim) if d != dimension))
    scales = (np.maximum(largest, 1e-8) / 127).astype(np.float32)
    along = [1] * weight.ndim
    along[dimension] = -1
    return np.clip(np.rint(weight / scales.reshape(along)), -127, 127).astype(np.int8), scales


def quantize_bias(bias, scales):
    values = np.rint(np.asarray(bias, np.float64) / scales)
    return np.clip(values, -(2**31), 2**31 - 1).astype(np.int32)


def quantize(real, scale, zero):
    return np.clip(np.rint(real / scale) + zero, LOW, HIGH).astype(np.int64)


def _convolve(op, x, x_zero):
    """Sums of (x - zero) * w in int64; padding is the zero point, so that it adds nothing."""
    weight, scales = quantize_weight(op.weight, 3 if op.kind == "depthwise" else 0)
    weight = weight.astype(np.int64)
    rows, columns = weight.shape[1:3]
    top, bottom = same_margins(x.shape[0], rows, op.stride, op.dilation)
    left, right = same_margins(x.shape[1], columns, op.stride, op.dilation)
    x = np.pad(x - x_zero, ((top, bottom), (left, right), (0, 0)))
    height = (x.shape[0] - (rows - 1) * op.dilation - 1) // op.stride + 1
    width = (x.shape[1] - (columns - 1) * op.dilation - 1) // op.stride + 1
    total = 0
    for i in range(rows):
        for j in range(columns):
            part = x[i * op.dilation:i * op.dilation + height * op.stride:op.stride,
                     j * op.dilation:j * op.dilation + width * op.stride:op.stride]
            total = total + (part * weight[0, i, j] if op.kind == "depthwise" else part @ weight[:, i, j].T)
    return total, scales


def _limits(op, scale, zero):
    low = max(LOW, zero) if op.activation != "none" else LOW
    high = min(HIGH, zero + int(6 / scale + 0.5)) if op.activation == "relu6" else HIGH
    return low, high


def _resize(x, zero, size):
    """Half-pixel bilinear in real numbers, rounded once."""
    for axis, length in enumerate(size):
        n = x.shape[axis]
        at = np.clip((np.arange(length) + 0.5) * n / length - 0.5, 0, n - 1)
        first = np.floor(at).astype(int)
        blend = (at - first).reshape([-1 if d == axis else 1 for d in range(3)])
        x = np.take(x, first, axis) * (1 - blend) + np.take(x, np.minimum(first + 1, n - 1), axis) * blend
    return x


def run(graph, image):
    """Every tensor as int64 [h, w, c] by name. `image`: real values [h, w, 3]."""
    t = {graph.input: quantize(image, *graph.ranges[graph.input])}
    for op in graph.ops:
        scale, zero = graph.ranges[op.output]
        in_scale, in_zero = graph.ranges[op.inputs[0]]
        x = t[op.inputs[0]]
        if op.kind in ("conv", "depthwise"):
            total, scales = _convolve(op, x, in_zero)
            if op.bias is not None:
                total = total + quantize_bias(op.bias, np.float32(in_scale) * scales)
            real = total * (in_scale * scales.astype(np.float64))
        elif op.kind == "add":
            other_scale, other_zero = graph.ranges[op.inputs[1]]
            real = (x - in_zero) * in_scale + (t[op.inputs[1]] - other_zero) * other_scale
        elif op.kind == "mean" or (op.kind == "average_pool" and not op.window):
            real = (x - in_zero).mean((0, 1), keepdims=True) * in_scale
        elif op.kind == "average_pool":
            h, w, c = x.shape
            real = (x - in_zero).reshape(h // op.window, op.window, w // op.window, op.window, c).mean((1, 3)) * in_scale
        elif op.kind == "resize":
            real = (_resize(x, in_zero, t[op.size_like].shape[:2]) - in_zero) * in_scale
        else:
            raise AssertionError(op.kind)
        low, high = _limits(op, scale, zero)
        t[op.output] = np.clip(np.rint(real / scale) + zero, low, high).astype(np.int64)
    return t
