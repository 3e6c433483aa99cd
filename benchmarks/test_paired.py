"""Tests of segments.py and of the statistics of ablate.py: python3 -m unittest discover benchmarks"""

import json
import math
import tempfile
import unittest
from pathlib import Path
from unittest.mock import patch

import ablate
import paired
import segments
from paired import Run, Target

# By the hash of their names, the first two are in the half for tuning, the others in the other half.
NAMES = ["CarDark", "Crossing", "CarScale", "Couple"]


def run(auc: float, lost: float = 0.0) -> Run:
    return Run("f0", [], auc, auc, lost, [], [], [])


def made(*aucs: float) -> list[list[Run]]:
    return [[run(auc)] for auc in aucs]


def targets(*sets: str) -> list[Target]:
    return [Target(name, target, [], []) for name, target in zip(sets, NAMES)]


class Frames(unittest.TestCase):
    truth = [(0.0, 0.0, 10.0, 10.0)] * 4

    def test_measures_are_those_of_the_method(self) -> None:
        # Overlaps 1, 1/3, 0 and none; centres 0, 5 and 21 pixels apart.
        own = [(0.0, 0.0, 10.0, 10.0), (5.0, 0.0, 10.0, 10.0), (21.0, 0.0, 10.0, 10.0), None]
        one = paired.run_of("f0", own, [*self.truth[:3], None], {}, [])
        self.assertEqual(one.overlaps, [1.0, 1 / 3, 0.0, None])
        # Of 21 thresholds, an overlap of 1 passes all but the last, and one of a third passes 7.
        self.assertAlmostEqual(one.auc, (20 + 7 + 0) / 21 / 3)
        self.assertAlmostEqual(one.dp, 2 / 3)
        self.assertAlmostEqual(one.lost, 1 / 3)
        self.assertTrue(one.is_lost)

    def test_a_frame_without_a_box_has_the_last_one(self) -> None:
        one = paired.run_of("f0", [None, self.truth[0], None, (50.0, 0.0, 1.0, 1.0)], self.truth, {}, [])
        self.assertEqual(one.overlaps, [0.0, 1.0, 1.0, 0.0])

    def test_files_are_read(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "0.txt"
            file.write_text("1,2,3,4\n1\t2\t3\t4\nnan,nan,nan,nan\n1,2,0,4\n")
            truth = paired.boxes(file)
            self.assertEqual(truth, [(1, 2, 3, 4)] * 2 + [None, None])
            said = {"status": ["tracked"] * 4, "score": [1.0] * 4, "jobs": 1, "seconds": [0.1] * 4}
            file.with_suffix(".json").write_text(json.dumps(said))
            read = paired.read_run(file, "r1", truth)
            self.assertEqual((read.auc, read.status, read.seconds), (20 / 21, ["tracked"] * 4, [0.1] * 4))
            with self.assertRaises(SystemExit):
                paired.read_run(file, "r1", truth[:3])


class Differences(unittest.TestCase):
    def test_half_is_fixed(self) -> None:
        self.assertEqual([paired.half(name) for name in NAMES], ["tuning", "tuning", "other", "other"])

    def test_both_standard_errors_agree(self) -> None:
        values = [0.1, -0.2, 0.3, 0.05, 0.0, 0.12, -0.07, 0.4] * 5
        one = paired.paired([(0.5, 0.5 + value) for value in values])
        self.assertAlmostEqual(one["difference"], sum(values) / 40)
        self.assertAlmostEqual(one["value"] - one["baseline"], one["difference"])
        # The bootstrap divides by n, the sample deviation by n - 1.
        self.assertAlmostEqual(one["error"] / one["plain_error"], math.sqrt(39 / 40), delta=0.02)
        self.assertEqual(one, paired.paired([(0.5, 0.5 + value) for value in values]))

    def test_differences_are_paired(self) -> None:
        # Targets differ much, the change of each is the same.
        one = paired.paired([(0.1, 0.2), (0.5, 0.6), (0.8, 0.9)])
        self.assertAlmostEqual(one["difference"], 0.1)
        self.assertAlmostEqual(one["error"], 0.0)

    def test_pairs_without_a_value_do_not_count(self) -> None:
        one = paired.paired([(None, 0.2), (0.5, 0.6), (0.8, None)])
        self.assertEqual((one["targets"], one["error"], one["plain_error"]), (1, None, None))
        self.assertIsNone(paired.paired([])["difference"])

    def test_a_target_is_the_mean_over_its_segments(self) -> None:
        # Six segments of one target do not outweigh two of another.
        base = [[run(0.5)] * 6, [run(0.5)] * 2]
        own = [[run(0.6)] * 6, [run(0.5), run(0.3)]]
        parts = paired.differences(targets("a", "a"), base, own)["auc"]
        self.assertAlmostEqual(parts["all"]["difference"], (0.1 - 0.1) / 2)
        self.assertEqual([parts[part]["targets"] for part in paired.PARTS], [2, 2, 0])

    def test_halves_are_beside_each_other(self) -> None:
        own = made(0.6, 0.7, 0.4, 0.5)
        parts = paired.differences(targets(*"aabb"), made(0.5, 0.5, 0.5, 0.5), own)["auc"]
        self.assertAlmostEqual(parts["tuning"]["difference"], 0.15)
        self.assertAlmostEqual(parts["other"]["difference"], -0.05)
        self.assertAlmostEqual(parts["all"]["difference"], 0.05)


class SegmentChanges(unittest.TestCase):
    def test_changes_are_counted(self) -> None:
        base = [[run(0.6), run(0.1, lost=0.9)], [run(0.5)], [run(0.2, lost=0.5)]]
        own = [[run(0.7), run(0.5)], [run(0.2, lost=0.6)], [run(0.1, lost=0.8)]]
        one = paired.segments(targets(*"aab"), base, own)
        counts = [one["all"][key] for key in ("segments", "lost", "newly_lost", "newly_kept")]
        self.assertEqual(counts, [4, 2, 1, 1])
        self.assertEqual([one[part]["lost"] for part in ("tuning", "other")], [1, 1])
        self.assertAlmostEqual(one["all"]["auc_kept_by_both"]["difference"], 0.1)
        self.assertAlmostEqual(one["all"]["auc_other_segments"]["difference"], (0.4 - 0.3 - 0.1) / 3)


class Comparisons(unittest.TestCase):
    def verdict(self, base: list[list[Run]], own: list[list[Run]]) -> str:
        return paired.compare(targets(*"aabb"), base, own)["verdict"]

    def test_a_gain_is_above_its_error(self) -> None:
        base = made(0.5, 0.5, 0.5, 0.5)
        self.assertEqual(self.verdict(base, made(0.6, 0.62, 0.58, 0.6)), "gain")
        self.assertEqual(self.verdict(base, made(0.9, 0.5, 0.5, 0.45)), "no")
        self.assertEqual(self.verdict(base, base), "no")

    def test_no_set_may_lose_much(self) -> None:
        base = made(0.5, 0.5, 0.5, 0.5)
        self.assertEqual(self.verdict(base, made(0.7, 0.7, 0.49, 0.492)), "gain")
        self.assertEqual(self.verdict(base, made(0.7, 0.7, 0.48, 0.49)), "no")


class Segments(unittest.TestCase):
    def made(self, *flags: str) -> dict[str, tuple[str, list[str]]]:
        """The first box and the images of each sequence that is made of a target of eight frames."""
        with tempfile.TemporaryDirectory() as temporary:
            dataset, out = Path(temporary) / "set", Path(temporary) / "out"
            images = dataset / "Girl" / "img"
            images.mkdir(parents=True)
            for k in range(1, 9):
                (images / f"{k}.jpg").touch()
            boxes = "".join(f"{k},2,10,10\n" for k in range(1, 9))
            (dataset / "Girl" / "groundtruth_rect.txt").write_text(boxes, encoding="utf-8")
            with patch("sys.argv", ["segments.py", str(dataset), "--out", str(out), *flags]):
                segments.main()
            made = ablate.segments_of(out)
            self.assertEqual(list(made), ["Girl"])
            return {name.removeprefix("Girl-"): self.read(out / name) for name in made["Girl"]}

    def read(self, folder: Path) -> tuple[str, list[str]]:
        boxes = (folder / "groundtruth_rect.txt").read_text(encoding="utf-8").splitlines()
        images = [image.resolve().stem for image in sorted((folder / "img").iterdir())]
        self.assertEqual(len(boxes), len(images))
        return boxes[0], images

    def test_segments_begin_at_different_frames_both_ways(self) -> None:
        made = self.made()
        self.assertEqual(list(made), ["f0", "f1", "f2", "r0", "r1", "r2"])
        self.assertEqual(made["f1"], ("3,2,10,10", list("345678")))
        self.assertEqual(made["r2"], ("4,2,10,10", list("4321")))

    def test_they_end_after_so_many_frames(self) -> None:
        made = self.made("--frames", "3")
        self.assertEqual(made["f0"], ("1,2,10,10", list("123")))
        self.assertEqual(made["r1"], ("6,2,10,10", list("654")))

    def test_starts_differ_in_the_first_box(self) -> None:
        made = self.made("--whole")
        self.assertEqual([box for box, _ in made.values()], ["1,2,10,10", "1.001,2,10,10", "0.999,2,10,10"])
        self.assertTrue(all(images == list("12345678") for _, images in made.values()))


class Promises(unittest.TestCase):
    def test_frames_are_counted_without_the_first(self) -> None:
        status = ["lost", "tracked", "tracked", "tracked", "lost", "uncertain"]
        score = [0.0, 0.95, 0.9, 0.5, 0.1, 0.2]
        overlaps = [1.0, 0.8, 0.05, None, 0.0, 0.09]
        backwards = Run("r0", [1.0, 0.0], 0.0, 0.0, 0.0, ["tracked"] * 2, [1.0] * 2, [])
        runs = [[Run("f0", overlaps, 0.0, 0.0, 0.0, status, score, []), backwards]]
        self.assertEqual(paired.promises(targets("a"), runs, ["f0", "r0"])["all"]["tracked_off"], 3 / 4)
        one = paired.promises(targets("a"), runs, ["f0"])["all"]
        self.assertAlmostEqual(one["tracked_off"], 2 / 3)
        self.assertAlmostEqual(one["off_tracked"], 2 / 4)
        self.assertAlmostEqual(one["off_lost"], 1 / 4)
        self.assertAlmostEqual(one["sure_missed"], 1 / 2)
        self.assertAlmostEqual(one["auroc"], 1.0)
        self.assertIsNone(paired.promises(targets("a"), runs, ["f0"])["other"]["ece"])

    def test_calibration_error_weighs_bins_by_their_frames(self) -> None:
        frames = [(0.92, True), (0.98, True), (1.0, False), (0.25, True), (0.25, False), (0.1, False)]
        self.assertAlmostEqual(paired.ece(frames), 0.25)

    def test_auroc_is_the_share_of_pairs_in_order(self) -> None:
        frames = [(0.6, True), (0.4, True), (0.4, False), (0.2, False), (0.7, False)]
        self.assertAlmostEqual(paired.auroc(frames), 3.5 / 6)
        self.assertIsNone(paired.auroc([(0.5, True)]))


class Tables(unittest.TestCase):
    def test_rows_are_as_long_as_their_heads(self) -> None:
        some = targets(*"aabb")
        some[0].attributes = ["OCC"]
        base, own = made(0.5, 0.5, 0.5, 0.5), made(0.6, 0.62, 0.58, 0.6)
        variants = {name: paired.compare(some, base, runs) for name, runs in (("old", base), ("new", own))}
        json.dumps(variants)
        text = ablate.tables(variants, with_targets=True)
        for part in text.split("## ")[1:]:
            lines = [line for line in part.splitlines() if line.startswith("|")]
            self.assertEqual(len({line.count("|") for line in lines}), 1, part)
        self.assertIn("+.100 ±", text)
        self.assertIn("| gain |", text)
        self.assertIn("| OCC | 1 (1 + 0) | new |", text)

    def test_numbers_have_no_zero_before_the_point(self) -> None:
        numbers = [ablate.shown(value) for value in (0.5, -0.01, 1.0, 10.04, None)]
        self.assertEqual(numbers, [".500", "-.010", "1.000", "10.040", "-"])


if __name__ == "__main__":
    unittest.main()
