"""Chooses the int8 scale of every tensor from what training pictures put into it."""

import numpy as np
import torch

from samples import whole
from train import MEAN, STD, to_tensor

BINS = 4096
# How much of the range's ends may be cut off; the best is what leaves the least squared error.
SHRINKS = np.concatenate([np.linspace(1.0, 0.5, 26), np.linspace(0.47, 0.2, 10)])


def image_range():
    """So that a byte b goes in as b - 128, unrounded."""
    return np.float32(1 / STD).item(), int(MEAN) - 128


def calibration_pictures(prepared, count):
    """Evenly from every source's training pictures."""
    for source in prepared:
        indices = source.indices("train")
        for i in indices[:: max(1, len(indices) * len(prepared) // count)]:
            yield whole(source.images[i], source.labels[i])[0]


def _histograms(net, prepared, device, count):
    names = [op.output for op in net.graph.ops if op.kind not in ("resize",) and not (op.kind == "average_pool")]
    low, high = {name: 0.0 for name in names}, {name: 0.0 for name in names}
    histograms = {name: np.zeros(BINS) for name in names}
    with torch.no_grad():
        for collect in (False, True):
            for image in calibration_pictures(prepared, count):
                tensors = net.tensors(to_tensor([image], device))
                for name in names:
                    value = tensors[name]
                    if not collect:
                        low[name], high[name] = min(low[name], value.min().item()), max(high[name], value.max().item())
                    elif high[name] > low[name]:
                        histograms[name] += torch.histc(value, BINS, low[name], high[name]).cpu().numpy()
    return low, high, histograms


def best_range(low, high, histogram):
    """(scale, zero point) of least squared error: rounding inside, cutting off outside. Zero is always exact."""
    values = low + (np.arange(BINS) + 0.5) * (high - low) / BINS
    total = max(histogram.sum(), 1)
    best = None
    for shrink_low in SHRINKS if low < 0 else [1.0]:
        for shrink_high in SHRINKS:
            scale = (high * shrink_high - low * shrink_low) / 255
            if scale <= 0:
                continue
            zero = int(np.clip(np.rint(-128 - low * shrink_low / scale), -128, 127))
            clipped = np.clip(values, (-128 - zero) * scale, (127 - zero) * scale)
            error = (histogram * (values - clipped) ** 2).sum() / total + scale**2 / 12
            if best is None or error < best[0]:
                best = (error, scale, zero)
    return (np.float32(best[1]).item(), best[2]) if best else (1.0, 0)


def choose_ranges(net, prepared, device, count=48):
    """Per tensor (scale, zero point)."""
    low, high, histograms = _histograms(net, prepared, device, count)
    ranges = {net.graph.input: image_range()}
    for op in net.graph.ops:
        if op.kind in ("resize", "average_pool"):
            ranges[op.output] = ranges[op.inputs[0]]  # kernels keep the scale of what they average
        elif op.activation == "relu6" and high[op.output] > 5:
            ranges[op.output] = (np.float32(6 / 255).item(), -128)
        else:
            ranges[op.output] = best_range(low[op.output], high[op.output], histograms[op.output])
    return ranges
