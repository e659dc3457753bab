import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
from PIL import Image

import support
import quantised
from graph import same_margins
from tflite_read import input_size, read_tflite
from tflite_write import tflite_bytes


def written(graph, folder, size=(32, 48)):
    path = pathlib.Path(folder) / "net.tflite"
    path.write_bytes(tflite_bytes(graph, *size))
    return path


class Weights(unittest.TestCase):
    def test_rounding_is_at_most_half_a_step_per_channel(self):
        weight = np.random.default_rng(2).normal(0, 1, (5, 3, 3, 7)).astype(np.float32)
        values, scales = quantised.quantize_weight(weight, 0)
        self.assertEqual(len(scales), 5)
        error = np.abs(values * scales.reshape(-1, 1, 1, 1) - weight)
        self.assertTrue((error <= scales.reshape(-1, 1, 1, 1) * 0.5001).all())

    def test_a_channel_of_zeros_stays_zero(self):
        values, scales = quantised.quantize_weight(np.zeros((2, 1, 1, 3), np.float32), 0)
        self.assertFalse(values.any())
        self.assertTrue((scales > 0).all())


class Margins(unittest.TestCase):
    def test_stride_two_on_even_lengths_pads_at_the_end(self):
        self.assertEqual(same_margins(480, 3, 2), (0, 1))

    def test_dilation_two_pads_two_on_both_sides(self):
        self.assertEqual(same_margins(30, 3, 1, 2), (2, 2))


class File(unittest.TestCase):
    def test_int8_round_trip_keeps_structure_and_weights(self):
        graph = support.small_graph(np.random.default_rng(3))
        with tempfile.TemporaryDirectory() as folder:
            path = written(graph, folder)
            self.assertEqual(input_size(path), (32, 48))
            back = read_tflite(path)
        self.assertEqual([op.kind for op in back.ops], [op.kind for op in graph.ops])
        for a, b in zip(graph.ops, back.ops):
            self.assertEqual((a.stride, a.dilation, a.activation, a.window), (b.stride, b.dilation, b.activation, b.window))
            self.assertEqual(graph.ranges[a.output], back.ranges[b.output])
            if a.weight is not None:
                self.assertLessEqual(np.abs(a.weight - b.weight).max(), np.abs(a.weight).max() / 127)

    def test_float_round_trip_is_exact(self):
        graph = support.small_graph(np.random.default_rng(4))
        graph.ranges = {}
        with tempfile.TemporaryDirectory() as folder:
            back = read_tflite(written(graph, folder))
        for a, b in zip(graph.ops, back.ops):
            if a.weight is not None:
                self.assertTrue((a.weight == b.weight).all() and (a.bias == b.bias).all())

    def test_constants_lie_at_multiples_of_16(self):
        import schema

        data = tflite_bytes(support.small_graph(np.random.default_rng(5)), 32, 48)
        model = schema.table("Model").Model.GetRootAs(data, 0)
        base = np.frombuffer(data, np.uint8).__array_interface__["data"][0]
        for i in range(1, model.BuffersLength()):
            values = model.Buffers(i).DataAsNumpy()
            self.assertEqual((values.__array_interface__["data"][0] - base) % 16, 0)


class Oracle(unittest.TestCase):
    def setUp(self):
        self.graph = support.small_graph(np.random.default_rng(6))
        self.pixels = np.random.default_rng(7).integers(0, 256, (32, 48, 3)).astype(np.uint8)
        self.real = (self.pixels.astype(np.float32) - 127) / 127.5

    @unittest.skipIf(support.absent("torch"), support.absent("torch") or "")
    def test_simulator_agrees_within_one_step(self):
        import torch

        from torch_net import Net

        net = Net(self.graph)
        net.ranges = self.graph.ranges
        exact = quantised.run(self.graph, self.real)
        real = {name: torch.from_numpy(((q - self.graph.ranges[name][1]) * self.graph.ranges[name][0]).astype(np.float32))
                .permute(2, 0, 1)[None] for name, q in exact.items()}
        for op in self.graph.ops:  # each from the oracle's inputs, so that differences do not pile up
            scale, zero = self.graph.ranges[op.output]
            with torch.no_grad():
                simulated = net.compute(op, real)[0].permute(1, 2, 0).numpy()
            difference = np.abs(np.rint(simulated / scale) + zero - exact[op.output])
            # One step where a real value lies on an exact half, as means of four often do.
            self.assertLessEqual(difference.max(), 1, op.output)
            if op.kind != "average_pool":
                self.assertLessEqual((difference > 0).mean(), 0.15, op.output)

    @unittest.skipUnless(os.path.exists(os.environ.get("TACTUS_NETWORK_ACCURACY", "")), "network_accuracy is not built")
    def test_the_programs_own_path_agrees(self):
        exact = quantised.run(self.graph, self.real)["scores"]
        best = exact.argmax(-1).astype(np.uint8)
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            model = written(self.graph, folder)
            Image.fromarray(self.pixels).save(folder / "image.png")
            Image.fromarray(best).save(folder / "truth.png")
            from export import class_map

            (folder / "map.toml").write_text(class_map("small", 1.0, 0, 0))
            (folder / "pairs.txt").write_text(f"{folder}/image.png\t{folder}/truth.png\n")
            done = subprocess.run([os.environ["TACTUS_NETWORK_ACCURACY"], model, folder / "map.toml", folder / "pairs.txt",
                                   "--predictions", folder / "out"], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            predicted = np.asarray(Image.open(folder / "out/image.png"))
        # Where two materials score within the few steps by which a half may round the other way, order decides: left out.
        ordered = np.sort(exact, -1)
        clear = ordered[..., -1] - ordered[..., -2] >= 4
        self.assertGreater(clear.mean(), 0.6)
        self.assertGreaterEqual((predicted == best)[clear].mean(), 0.999)
        self.assertGreater(json.loads(done.stdout)["pixel_accuracy"], 0.9)


if __name__ == "__main__":
    unittest.main()
