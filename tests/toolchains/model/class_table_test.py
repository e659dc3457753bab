import pathlib
import tempfile
import unittest

import support  # noqa: F401
import materials
from class_table import NYU40_FILE, read_class_table
from failure import BAD_USAGE, Failure


def table_of(text):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "table.toml"
        path.write_text(text)
        return read_class_table(path)


class ClassTable(unittest.TestCase):
    def test_nyu40_has_forty_rows_that_sum_to_one(self):
        sut = read_class_table(NYU40_FILE)
        self.assertEqual(len(sut.names), 40)
        self.assertTrue(all(abs(row.sum() - 1) < 1e-3 for row in sut.targets))

    def test_nyu40_ignores_what_says_nothing_about_its_material(self):
        sut = read_class_table(NYU40_FILE)
        for name in ("otherprop", "otherstructure", "otherfurniture", "lamp"):
            self.assertEqual(sut.weights[sut.names.index(name)], 0, name)

    def test_truth_is_only_what_is_sure(self):
        sut = read_class_table(NYU40_FILE)
        truth = dict(zip(sut.names, sut.truth()))
        self.assertEqual(truth["curtain"], materials.ID["fabric"])
        self.assertEqual(truth["floor"], materials.UNKNOWN)
        self.assertEqual(truth["otherprop"], materials.UNKNOWN)

    def test_names_are_those_of_the_program(self):
        text = (support.ROOT / "pipeline/label/material.hpp").read_text()
        body = text[text.index("kMaterialNames = {") :]
        self.assertEqual(tuple(body[: body.index("}")].split('"')[1::2]), materials.NAMES)

    def test_unknown_material_is_one_sentence_and_bad_usage(self):
        with self.assertRaisesRegex(Failure, "'gold' is none of the 23 materials") as caught:
            table_of('[[class]]\nname = "ring"\nmaterials = { gold = 1.0 }\n')
        self.assertEqual(caught.exception.code, BAD_USAGE)

    def test_shares_that_do_not_sum_to_one_are_refused(self):
        with self.assertRaisesRegex(Failure, "sum to 0.9, not 1"):
            table_of('[[class]]\nname = "wall"\nmaterials = { painted = 0.9 }\n')

    def test_misspelt_key_is_refused(self):
        with self.assertRaisesRegex(Failure, "no key 'wieght'"):
            table_of('[[class]]\nname = "wall"\nmaterials = { painted = 1.0 }\nwieght = 0\n')


if __name__ == "__main__":
    unittest.main()
