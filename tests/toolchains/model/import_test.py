import os
import pathlib
import unittest

import numpy as np

import support
from failure import Failure
from tflite_read import read_tflite

DATA = pathlib.Path(os.environ.get("TACTUS_SHARED_DATA", support.ROOT / "../shared/data"))
ADE20K = DATA / "models/deeplabv3_mnv2_ade20k_int8.tflite"


class Import(unittest.TestCase):
    @unittest.skipUnless(ADE20K.exists(), "the shared network deeplabv3_mnv2_ade20k_int8.tflite is absent")
    @unittest.skipIf(support.absent("torch"), support.absent("torch") or "")
    def test_network_without_concatenations_scores_as_the_original(self):
        import torch

        from materials_network import from_deeplab, with_original_scores
        from torch_net import Net

        torch.set_num_threads(1)
        source = read_tflite(ADE20K)
        resize = source.op(source.op(source.scores).inputs[0])
        sut = Net(with_original_scores(from_deeplab(source, np.random.default_rng(1), decoder_stride=4), source))
        image = torch.from_numpy(np.random.default_rng(2).uniform(-1, 1, (1, 3, 160, 160)).astype(np.float32))
        with torch.no_grad():
            original = Net(source).tensors(image)[resize.inputs[0]]
            ours = sut(image)
        self.assertEqual(tuple(ours.shape), (1, 32, 40, 40))
        self.assertGreater(original.abs().max().item(), 5)
        # Only the order of sums differs.
        self.assertLess((ours - original).abs().max().item(), 1e-3 * original.abs().max().item())

    def test_file_that_is_no_network_is_one_sentence(self):
        with self.assertRaisesRegex(Failure, "is no .tflite file"):
            read_tflite(pathlib.Path(__file__))

    def test_another_network_is_refused_as_a_start(self):
        from materials_network import from_deeplab

        with self.assertRaisesRegex(Failure, "not a DeepLabV3"):
            from_deeplab(support.small_graph(np.random.default_rng(3)), np.random.default_rng(1))


if __name__ == "__main__":
    unittest.main()
