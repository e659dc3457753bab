"""The four label metrics of the paper (Chen et al. 2018, section V; after Long et al. 2015)."""

import numpy as np

import materials


class Confusion:
    """Counts of (true, predicted) materials; pixels of unknown truth are not counted."""

    def __init__(self):
        self.counts = np.zeros((materials.COUNT, materials.COUNT), np.int64)

    def add(self, truth, predicted):
        known = truth != materials.UNKNOWN
        pairs = truth[known].astype(np.int64) * materials.COUNT + predicted[known]
        self.counts += np.bincount(pairs, minlength=materials.COUNT**2).reshape(self.counts.shape)

    def total(self):
        return int(self.counts.sum())

    def metrics(self):
        """Classes that the truth does not hold are left out of the means; predicting them still costs accuracy."""
        t, right = self.counts.sum(1), np.diag(self.counts)
        present = t > 0
        iu = right[present] / (t + self.counts.sum(0) - right)[present]
        return {
            "pixel_accuracy": float(right.sum() / t.sum()),
            "mean_accuracy": float((right[present] / t[present]).mean()),
            "mean_iu": float(iu.mean()),
            "frequency_weighted_iu": float((t[present] * iu).sum() / t.sum()),
            "iu": {materials.NAMES[i]: round(float(v), 4) for i, v in zip(np.flatnonzero(present), iu)},
        }
