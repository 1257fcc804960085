"""The arithmetic of bench/ablation.py on figures made up for it, and its measuring once.

    python tests/ablation_test.py
"""
import math
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "bench"))

import ablation  # noqa: E402
import matrix  # noqa: E402

PART = "no free space"


def runs(sequence, part, ates, **more):
    return [{"sequence": sequence, "part": part, "seed": seed, "live": False, "coverage": 1.0,
             "ate_mm": ate, **more} for seed, ate in enumerate(ates)]


class Paired(unittest.TestCase):
    def test_a_change_that_every_seed_shows_is_seen_through_seeds_that_differ_more(self):
        full = [1.0, 2.0, 4.0]
        results = ablation.Results(runs("a", ablation.FULL, full) +
                                   runs("a", PART, [1.1 * f for f in full]))
        mean, half = results.change("a", PART)
        self.assertAlmostEqual(mean, 10)
        self.assertAlmostEqual(half, 0, places=6)

    def test_interval_is_students(self):
        mean, half = ablation.interval([1.0, 2.0, 3.0])
        self.assertAlmostEqual(mean, 2)
        self.assertAlmostEqual(half, 4.3027 / math.sqrt(3), places=3)

    def test_seeds_without_a_full_run_do_not_count(self):
        results = ablation.Results(runs("a", ablation.FULL, [1.0, 1.0]) +
                                   runs("a", PART, [2.0, 2.0, 9.0]))
        self.assertAlmostEqual(results.change("a", PART)[0], 100)

    def test_ratio_over_sequences_is_geometric(self):
        lines = []
        for sequence, factor in (("a", 2.0), ("b", 0.5)):
            lines += runs(sequence, ablation.FULL, [3.0, 3.0])
            lines += runs(sequence, PART, [3.0 * factor] * 2)
        mean, low, high = ablation.Results(lines).ratio(PART)
        self.assertAlmostEqual(mean, 1)
        self.assertAlmostEqual(low * high, 1)
        self.assertLess(low, 0.5)

    def test_a_failed_run_is_no_figure(self):
        lines = runs("a", ablation.FULL, [1.0]) + [{"sequence": "a", "part": PART, "seed": 0}]
        self.assertIsNone(ablation.Results(lines).change("a", PART))

    def test_precision_and_recall_of_counts(self):
        counts = {"found": 90, "missed": 10, "false_alarms": 30}
        fewer = {"found": 60, "missed": 40, "false_alarms": 0}
        results = ablation.Results(runs("a", ablation.FULL, [1.0], **counts) +
                                   runs("a", PART, [1.0], **fewer))
        self.assertEqual(ablation.precision_recall(results.runs["a", PART].values()), (100, 60))
        self.assertEqual(results.truth_change(PART), (25, -30))


class Measured(unittest.TestCase):
    def test_a_line_that_is_there_is_not_measured_again(self):
        asked = []

        def job(number):
            asked.append(number)
            return {"n": number, "square": number * number}
        with tempfile.TemporaryDirectory() as name:
            file = pathlib.Path(name) / "results.jsonl"
            for count, workers in ((2, 1), (4, 3)):
                lines = matrix.measured(file, lambda line: line["n"],
                                        {n: lambda n=n: job(n) for n in range(count)}, workers)
                self.assertEqual(lines, [{"n": n, "square": n * n} for n in range(count)])
            self.assertEqual(len(file.read_text().splitlines()), 4)
        self.assertEqual(sorted(asked), [0, 1, 2, 3])


if __name__ == "__main__":
    unittest.main()
