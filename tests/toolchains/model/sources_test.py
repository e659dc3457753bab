import contextlib
import io
import pathlib
import tempfile
import unittest

import numpy as np
from PIL import Image

import support
import sources
import tactus_model
from class_table import exact_table
from failure import BAD_INPUT, Failure


def save(path, array):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(array).save(path)


class Split(unittest.TestCase):
    def test_minc_ids_go_four_to_one_and_stay(self):
        ids = [f"{n:09d}" for n in range(7061)]
        parts = [sources.minc_part(i) for i in ids]
        share = parts.count(sources.VALIDATION) / len(parts)
        # Binomial: 0.2 with a standard deviation of 0.0048.
        self.assertAlmostEqual(share, 0.2, delta=0.015)
        self.assertEqual(parts, [sources.minc_part(i) for i in ids])
        # The split is part of what a trained network means: it must never move.
        self.assertEqual("".join(p[0] for p in parts[:24]), "tttttvtvtttttttttttvttvt")

    def test_variants_are_held_out_with_their_scene(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for scene in ("den", "den_v1", "den_v2", "hall"):
                save(folder / scene / "rgb/0.png", np.zeros((4, 6, 3), np.uint8))
                save(folder / scene / "label/0.png", np.zeros((4, 6), np.uint8))
            sut = sources.rendered_rooms(folder, ["den"])
            self.assertEqual({p.scene: p.part for p in sut.pictures},
                             {"den": "validation", "den_v1": "validation", "den_v2": "validation", "hall": "train"})
            with self.assertRaisesRegex(Failure, "no scene 'attic' to hold out; it has den, hall"):
                sources.rendered_rooms(folder, ["attic"])

    @unittest.skipIf(support.absent("scipy"), support.absent("scipy") or "")
    def test_nyuv2_training_holds_none_of_the_test_split(self):
        import scipy.io

        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for sub in ("rgb", "label40"):
                (folder / sub).mkdir()
            numbers = np.arange(1, 101)
            scipy.io.savemat(folder / "splits.mat", {"trainNdxs": numbers[:60, None], "testNdxs": numbers[60:, None]})
            train = sources.nyuv2(folder, sources.TRAIN).pictures
            test = sources.nyuv2(folder, sources.TEST).pictures
            self.assertFalse({p.image for p in train} & {p.image for p in test})
            self.assertEqual((len(train), len(test)), (60, 40))
            self.assertEqual(train[0].image.name, "0000.jpg")
            self.assertEqual({p.part for p in test}, {"test"})


class ReadPicture(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def read(self, label):
        save(self.folder / "a.png", np.zeros((4, 6, 3), np.uint8))
        save(self.folder / "b.png", label)
        return sources.read_picture(sources.Picture(self.folder / "a.png", self.folder / "b.png", "s", "train"), exact_table())

    def test_label_of_another_size_is_bad_input(self):
        with self.assertRaisesRegex(Failure, "is 5x4, but its picture is 6x4") as caught:
            self.read(np.zeros((4, 5), np.uint8))
        self.assertEqual(caught.exception.code, BAD_INPUT)

    def test_class_beyond_the_table_is_bad_input(self):
        with self.assertRaisesRegex(Failure, "holds class 23, but there are 23 classes"):
            self.read(np.full((4, 6), 23, np.uint8))

    def test_unlabelled_pixels_are_taken(self):
        _, label = self.read(np.full((4, 6), 255, np.uint8))
        self.assertTrue((label == 255).all())


class CommandLine(unittest.TestCase):
    def run_tool(self, *arguments):
        errors = io.StringIO()
        with contextlib.redirect_stderr(errors):
            try:
                code = tactus_model.main(list(arguments))
            except SystemExit as stop:  # argparse
                code = stop.code
        return code, errors.getvalue()

    def test_missing_folder_is_one_sentence_and_code_3(self):
        code, errors = self.run_tool("prepare", "--data", "/absent", "--out", "never")
        self.assertEqual((code, errors), (3, "/absent: there is no such folder.\n"))

    def test_size_that_is_no_multiple_of_16_is_code_2(self):
        code, errors = self.run_tool("export", "--run", "x", "--out", "y", "--size", "480x270")
        self.assertEqual(code, 2)
        self.assertIn("480x270: both sides must be multiples of 16", errors)

    def test_prepare_writes_what_it_read(self):
        from samples import open_prepared

        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            rgb = np.random.default_rng(1).integers(0, 255, (8, 12, 3), np.uint8)
            label = np.arange(96, dtype=np.uint8).reshape(8, 12) % 23
            for scene in ("den", "hall"):
                save(folder / "rooms_rendered" / scene / "rgb/0.png", rgb)
                save(folder / "rooms_rendered" / scene / "label/0.png", label)
            with contextlib.redirect_stdout(io.StringIO()) as out:
                code = tactus_model.main(["prepare", "--data", name, "--hold-out", "den", "--out", f"{name}/prepared"])
            self.assertEqual(code, 0)
            self.assertIn("2 pictures of 12x8, 1 validation, 1 train", out.getvalue())
            (sut,) = open_prepared(folder / "prepared")
            self.assertTrue((sut.images[0] == rgb).all() and (sut.labels[1] == label).all())
            self.assertEqual(sut.indices("validation"), [0])


if __name__ == "__main__":
    unittest.main()
