"""The notebook a newcomer opens first: every cell runs, and shows what its text says.

    PYTHONPATH=build/release/python python tests/notebook_test.py

The cells are plain Python, so that they run here one after another without Jupyter.
"""
import contextlib
import io
import json
import os
import shutil
import unittest

os.environ["MPLBACKEND"] = "Agg"
import matplotlib.pyplot as plt  # noqa: E402 - the line above first

from ygslam_cli import ROOT  # noqa: E402

NOTEBOOK = ROOT / "examples" / "notebook" / "first_steps.ipynb"


class Notebook(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]

    def test_it_is_kept_without_outputs(self):
        self.assertLess(NOTEBOOK.stat().st_size, 20_000)
        self.assertEqual(len({cell["id"] for cell in self.cells}), len(self.cells))
        for cell in self.cells:
            if cell["cell_type"] == "code":
                self.assertEqual((cell["outputs"], cell["execution_count"]), ([], None))

    def test_every_file_it_names_is_there(self):
        text = "".join("".join(cell["source"]) for cell in self.cells
                       if cell["cell_type"] == "markdown")
        named = [word for word in text.split("`") if word.startswith(("docs/", "examples/"))]
        self.assertGreater(len(named), 4)
        for name in named:
            self.assertTrue((ROOT / name).exists(), name)

    def test_its_cells_run_and_show_what_they_say(self):
        seen = {}
        self.addCleanup(lambda: shutil.rmtree(seen["folder"], ignore_errors=True))
        self.addCleanup(plt.close, "all")
        said, figures = io.StringIO(), 0
        for number, cell in enumerate(self.cells):
            if cell["cell_type"] != "code":
                continue
            with contextlib.redirect_stdout(said):
                exec(compile("".join(cell["source"]), f"cell {number}", "exec"), seen)
            figures += len(plt.get_fignums())
            plt.close("all")
        self.assertEqual(figures, 3)
        self.assertIn("120 of 120 frames tracked", said.getvalue())
        full, off = seen["ate"]["full"][0], seen["ate"]["off"][0]
        self.assertLess(full, 10, "millimetres")
        self.assertLess(1.5 * full, off, "the people would have done something to it")
        self.assertEqual(len(seen["people"]), 2)
        self.assertGreater(len(seen["p_room"]), 10_000)
        height = seen["p_room"][:, 2]
        self.assertGreater((abs(height) < 0.05).mean(), 0.05, "the floor lies at height 0")


if __name__ == "__main__":
    unittest.main()
