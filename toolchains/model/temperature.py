"""Calibrated probabilities: one temperature for the softmax, fitted on pictures that training has not seen."""

import numpy as np
import torch
import torch.nn.functional as F

import materials
from samples import whole
from train import to_tensor

BINS = 15


def scores_and_truth(net, source, device, every=1):
    """(scores [n, 23], truth [n]) at the label's stride, over the source's validation pictures."""
    scores, truths = [], []
    with torch.no_grad():
        for i in source.indices("validation")[::every]:
            image, label = whole(source.images[i], source.labels[i])
            truth = source.truth[source.rows_of(label)]
            enlarged = F.interpolate(net(to_tensor([image], device)), size=label.shape, mode="bilinear", align_corners=False)
            known = truth != materials.UNKNOWN
            # Every 7th: neighbours say the same, and 100 pictures hold 800,000 pixels.
            scores.append(enlarged[0].permute(1, 2, 0).cpu().numpy()[known][::7])
            truths.append(truth[known][::7])
    return np.concatenate(scores), np.concatenate(truths)


def softmax(scores, temperature):
    e = np.exp((scores - scores.max(1, keepdims=True)) / temperature)
    return e / e.sum(1, keepdims=True)


def negative_log_likelihood(scores, truth, temperature):
    p = softmax(scores, temperature)
    return -np.log(np.maximum(p[np.arange(len(truth)), truth], 1e-9)).mean()


def expected_calibration_error(scores, truth, temperature):
    """Mean distance between how sure the winner is and how often it is right, over 15 equal bins (Guo et al. 2017)."""
    p = softmax(scores, temperature)
    confidence, right = p.max(1), p.argmax(1) == truth
    bins = np.minimum((confidence * BINS).astype(int), BINS - 1)
    error = 0.0
    for b in range(BINS):
        inside = bins == b
        if inside.any():
            error += inside.mean() * abs(confidence[inside].mean() - right[inside].mean())
    return float(error)


def fit(sets):
    """The temperature that makes the held-out truth most likely, each set counting the same."""
    candidates = np.exp(np.linspace(np.log(0.4), np.log(5), 120))
    losses = [np.mean([negative_log_likelihood(s, t, c) for s, t in sets]) for c in candidates]
    return round(float(candidates[int(np.argmin(losses))]), 3)
