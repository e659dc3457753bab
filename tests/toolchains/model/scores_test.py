import unittest

import numpy as np

import support
from materials import ID, UNKNOWN


class Metrics(unittest.TestCase):
    def test_hand_computed_matrix(self):
        from scores import Confusion

        sut = Confusion()
        # 4 wood (3 right, 1 called fabric), 2 fabric (1 right, 1 called glass), 1 unlabelled.
        w, f, g = ID["wood"], ID["fabric"], ID["glass"]
        sut.add(np.array([w, w, w, w, f, f, UNKNOWN]), np.array([w, w, w, f, f, g, w]))
        m = sut.metrics()
        self.assertAlmostEqual(m["pixel_accuracy"], 4 / 6)
        self.assertAlmostEqual(m["mean_accuracy"], (3 / 4 + 1 / 2) / 2)
        self.assertAlmostEqual(m["mean_iu"], (3 / 4 + 1 / 3) / 2)  # glass is not in the truth: left out
        self.assertAlmostEqual(m["frequency_weighted_iu"], (4 * 3 / 4 + 2 * 1 / 3) / 6)


@unittest.skipIf(support.absent("torch"), support.absent("torch") or "")
class Temperature(unittest.TestCase):
    def test_overconfident_scores_are_cooled_and_the_error_falls(self):
        import temperature

        rng = np.random.default_rng(8)
        truth = rng.integers(0, 23, 4000)
        logits = rng.normal(0, 1, (4000, 23))
        logits[np.arange(4000), truth] += 2.0
        # Calibrated by construction up to a factor: three times too sure.
        held_out = (3 * logits, np.eye(23)[truth], np.ones(4000))
        fitted = temperature.fit([held_out])
        self.assertGreater(fitted, 1.5)
        before = temperature.expected_calibration_error(*held_out, 1.0)
        after = temperature.expected_calibration_error(*held_out, fitted)
        self.assertLess(after, 0.5 * before)

    def test_winner_with_a_share_is_right_that_often(self):
        import temperature

        shares = np.zeros((10, 23))
        shares[:, 0], shares[:, 1] = 0.75, 0.25
        scores = np.full((10, 23), -50.0)
        scores[:, 0], scores[:, 1] = np.log(0.75), np.log(0.25)
        self.assertLess(temperature.expected_calibration_error(scores, shares, np.ones(10), 1.0), 1e-6)


@unittest.skipIf(support.absent("torch"), support.absent("torch") or "")
class Loss(unittest.TestCase):
    def test_ignored_pixels_have_no_gradient(self):
        import torch

        from train import soft_loss

        scores = torch.zeros(1, 23, 2, 2, requires_grad=True)
        targets = torch.zeros(1, 2, 2, 23)
        targets[..., ID["wood"]] = 1
        weights = torch.ones(1, 2, 2)
        weights[0, 0, 0] = 0
        soft_loss(scores, targets, weights, torch.ones(23)).backward()
        self.assertEqual(scores.grad[0, :, 0, 0].abs().max().item(), 0)
        self.assertLess(scores.grad[0, ID["wood"], 1, 1].item(), 0)


if __name__ == "__main__":
    unittest.main()
