"""somp.json: joint sparse codes by SPAMS, on patches of rendered scenes and on random problems.

    python somp.py FRAMES

FRAMES holds the folders demo, occluded and square, each with img/*.ppm and groundtruth_rect.txt; see
README.md. The file contains all images of the problems, so the test needs no frames.

Each result of SPAMS is compared with a simple numpy solver, somp_reference.py. Problems on which both agree
are listed under `agree`. If atoms are nearly dependent, SPAMS gives wrong results; these problems are listed
under `spams_degenerate` with both results.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np

import golden
import patchwise
import somp_compare
from patchwise import LARGE, SMALL, Scale, Setting


class ImagePool:
    """The 32x32 images of all settings, each stored once and referenced by index."""

    def __init__(self) -> None:
        self.rows: list[np.ndarray] = []
        self.index: dict[bytes, int] = {}

    def add(self, images: np.ndarray) -> list[int]:
        for image in images:
            if image.tobytes() not in self.index:
                self.index[image.tobytes()] = len(self.rows)
                self.rows.append(image)
        return [self.index[image.tobytes()] for image in images]

    def describe(self, setting: Setting) -> dict[str, Any]:
        return {
            "name": setting.name,
            "templates": self.add(setting.templates),
            "buffer": self.add(setting.buffer),
            "candidates": self.add(setting.candidates),
        }


class ComparedRecords:
    """Records, split by whether SPAMS and the reference agree."""

    def __init__(self) -> None:
        self.agree: list[dict[str, Any]] = []
        self.degenerate: list[dict[str, Any]] = []

    def add(self, where: dict[str, Any], signals: np.ndarray, dictionary: np.ndarray) -> None:
        record, difference = somp_compare.compare(signals, dictionary)
        if difference is None:
            self.agree.append(where | record)
        else:
            self.degenerate.append(where | record | {"difference": difference})

    def lists(self) -> dict[str, Any]:
        return {"agree": self.agree, "spams_degenerate": self.degenerate}


def draw(rng: np.random.Generator, scale: Scale, candidates: int, count: int) -> list[tuple[int, int]]:
    """Draws pairs (candidate, location): candidates in turn, locations without repeats until all are used."""
    rounds = -(-count // scale.locations)
    locations = np.concatenate([rng.permutation(scale.locations) for _ in range(rounds)])[:count]
    return [(k % candidates, int(location)) for k, location in enumerate(locations)]


def add_problems(
    rng: np.random.Generator, found: ComparedRecords, setting: Setting, index: int, counts: dict[Scale, int]
) -> None:
    for scale, count in counts.items():
        dictionary = patchwise.dictionary(setting.templates, scale)
        for which, location in draw(rng, scale, len(setting.candidates), count):
            where = {"setting": index, "scale": scale.name, "candidate": which, "location": location}
            found.add(where, setting.signals(scale, which, location), dictionary)


def scale_description(scale: Scale) -> dict[str, Any]:
    return {"size": scale.size, "step": scale.step, "per_row": scale.per_row, "locations": scale.locations}


def content(
    rng: np.random.Generator, head: dict[str, Any], plan: list[tuple[Setting, dict[Scale, int]]]
) -> dict[str, Any]:
    """The content of a file in this format, except for the random problems."""
    pool, found = ImagePool(), ComparedRecords()
    settings = [pool.describe(setting) for setting, _ in plan]
    for index, (setting, counts) in enumerate(plan):
        add_problems(rng, found, setting, index, counts)
    return {
        "header": head,
        "limit": somp_compare.LIMIT,
        "scales": {s.name: scale_description(s) for s in (SMALL, LARGE)},
        "images": golden.f32s(pool.rows),
        "settings": settings,
        **found.lists(),
    }


def scene_plan(rng: np.random.Generator, frames: Path) -> list[tuple[Setting, dict[Scale, int]]]:
    demo, occluded, square = (
        patchwise.read_sequence(frames / name) for name in ("demo", "occluded", "square")
    )
    tracked = patchwise.setting(rng, demo, 4, tracked=True)
    first = patchwise.setting(rng, occluded, 4, tracked=False)
    # A target of 32x32 pixels: templates shifted by whole pixels contain the same patches at other locations.
    shifted = patchwise.setting(rng, square, 3, tracked=False)
    # The state after updates without any change: repeated templates and a repeated buffer.
    late = tracked.buffer[[0, 0, 1, 1]]
    repeated = Setting(
        "demo, repeated templates", np.vstack([tracked.templates[:6], late]), late, tracked.candidates
    )
    return [
        (tracked, {SMALL: 26, LARGE: 12}),
        (first, {SMALL: 26, LARGE: 12}),
        (shifted, {SMALL: 5, LARGE: 3}),
        (repeated, {SMALL: 5, LARGE: 6}),
    ]


def random_dictionary(rng: np.random.Generator, flaw: str) -> np.ndarray:
    """40 random atoms of 16 numbers; with a flaw, pairs or triples are dependent.

    None is zero, since SPAMS refuses zero atoms.
    """
    atoms = rng.normal(size=(16, 40))
    if flaw == "repeated atoms":
        atoms[:, 20:] = atoms[:, :20]
    if flaw == "sums of atoms":
        atoms[:, 20:30] = atoms[:, :10] + atoms[:, 10:20]
    return np.asfortranarray(patchwise.normalised(atoms))


def random_signals(rng: np.random.Generator, dictionary: np.ndarray, flaw: str) -> np.ndarray:
    if flaw == "zero signals":
        return np.zeros((16, 3))
    if flaw == "":
        return golden.as_f32(rng.normal(size=(16, 3)))
    # Few atoms and a little noise, so that the flaw matters: two atoms, and one that depends on them.
    return golden.as_f32(
        dictionary[:, [0, 1, 10]] @ rng.normal(size=(3, 3)) + 0.05 * rng.normal(size=(16, 3))
    )


def random_problems(rng: np.random.Generator) -> dict[str, Any]:
    found = ComparedRecords()
    for flaw in [""] * 12 + ["repeated atoms"] * 2 + ["sums of atoms"] * 2 + ["zero signals"]:
        dictionary = random_dictionary(rng, flaw)
        signals = random_signals(rng, dictionary, flaw)
        where = {"flaw": flaw, "dictionary": golden.f32s(dictionary.T), "signals": golden.f32s(signals.T)}
        found.add(where, signals, dictionary)
    return found.lists()


def header(frames_by: str) -> dict[str, Any]:
    return golden.header(
        ["spams-bin", "numpy", "scipy", "opencv-contrib-python-headless"],
        "Joint sparse codes of five patches (candidate first) by spams.somp(L=4, eps=0), checked with a "
        f"numpy reference; frames: {frames_by}. `coefficients` are those of the first signal, in the order "
        "of `atoms`; `residual_energies` per signal; `step_energies` of all signals after 0, 1, .. atoms.",
    )


def main() -> None:
    rng = np.random.default_rng(5)
    file = content(rng, header("patchlock-scene"), scene_plan(rng, Path(sys.argv[1])))
    file["random"] = random_problems(rng)
    for name, part in (("scenes", file), ("random", file["random"])):
        print(f"{name}: {len(part['agree'])} agree, {len(part['spams_degenerate'])} degenerate")
    golden.write("somp.json", file)


if __name__ == "__main__":
    main()
