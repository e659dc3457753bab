import contextlib
import io
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
from PIL import Image

import support
import tactus_model
from class_table import exact_table
from evaluate import _with_material_truth
from materials import ID, UNKNOWN
from sources import TEST, Picture, Source

TOOL = pathlib.Path(os.environ.get("TACTUS_NETWORK_ACCURACY", "absent"))


class Truth(unittest.TestCase):
    def test_objects_become_truth_only_where_the_table_is_sure(self):
        table = exact_table()
        table.targets[ID["glass"]] = 0
        table.targets[ID["glass"], [ID["glass"], ID["painted"]]] = 0.6, 0.4
        table.weights[ID["metal"]] = 0
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            Image.fromarray(np.zeros((2, 2, 3), np.uint8)).save(folder / "a.png")
            label = np.array([[ID["wood"], ID["glass"]], [ID["metal"], UNKNOWN]], np.uint8)
            Image.fromarray(label).save(folder / "b.png")
            source = Source("objects", table, [Picture(folder / "a.png", folder / "b.png", "s", TEST)])
            ((_, truth),) = _with_material_truth(source, folder)
            self.assertEqual(np.asarray(Image.open(truth)).tolist(), [[ID["wood"], UNKNOWN], [UNKNOWN, UNKNOWN]])


@unittest.skipUnless(TOOL.exists(), "network_accuracy is not built")
class Tool(unittest.TestCase):
    def run_tool(self, *arguments):
        done = subprocess.run([TOOL, *map(str, arguments)], capture_output=True, text=True)
        return done.returncode, done.stderr

    def test_no_arguments_is_bad_usage(self):
        code, errors = self.run_tool()
        self.assertEqual(code, 2)
        self.assertTrue(errors.startswith("usage: network_accuracy"))

    def test_label_of_another_size_is_one_sentence_and_code_3(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            Image.fromarray(np.zeros((20, 30, 3), np.uint8)).save(folder / "a.png")
            Image.fromarray(np.zeros((20, 31), np.uint8)).save(folder / "b.png")
            (folder / "pairs.txt").write_text(f"{folder}/a.png\t{folder}/b.png\n")
            code, errors = self.run_tool("builtin", "builtin", folder / "pairs.txt")
        self.assertEqual(code, 3)
        self.assertIn("b.png: is 31x20, but its picture is 30x20.\n", errors)

    def test_missing_data_set_is_one_sentence_and_code_3(self):
        errors = io.StringIO()
        with tempfile.TemporaryDirectory() as name, contextlib.redirect_stderr(errors):
            code = tactus_model.main(["evaluate", "--data", name, "--set", "nyuv2", "--tool", str(TOOL)])
        self.assertEqual(code, 3)
        self.assertIn("nyuv2: there is no such folder.\n", errors.getvalue())


if __name__ == "__main__":
    unittest.main()
