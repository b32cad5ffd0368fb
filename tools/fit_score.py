#!/usr/bin/env python3
"""Fits the coefficients of the tracker's score to annotated frames, and says how good the score is with them.

    pip install numpy
    bagtrack-eval path/to/sequences/* --seeds 2 --frames some.jsonl
    bagtrack-eval path/to/others/* --seeds 2 --frames others.jsonl
    tools/fit_score.py some.jsonl others.jsonl

The fit is a logistic regression of hit (an overlap of at least a half) on the score's predictors, over the frames in
which the target is not lost. It minimises the mean over the sequences of their mean logistic losses, so that each
sequence has the same weight however long it is. `ScoreModel::TRACKER` of crates/tracker has such coefficients.

Prints a row for the score that the tracker gave, one for the fit, and one for each fit that leaves a sequence out, over
that sequence. The area under the ROC curve and the expected calibration error are those of `bagtrack-eval`, over all
scored frames.
"""

import json
import pathlib
import sys

try:
    import numpy as np
except ImportError:
    sys.exit("fit_score: numpy is missing; pip install numpy")

NAMES = ["intercept", "discriminant", "first distance", "mean first distance", "abs ln scale"]
HIT_OVERLAP = 0.5
# The score of a lost target is no higher.
MAX_LOST = 0.1
# Keeps the coefficients finite where a threshold separates all hits from all misses.
RIDGE = 1e-6


class Frames:
    """Scored frames: a row of predictors, with a 1 for the intercept, and what is known of each."""

    def __init__(self, lines):
        if any(line["predictors"] is None for line in lines):
            sys.exit("fit_score: there is no score to fit without a discriminant: discriminant_weight must be above 0")
        self.rows = np.array([[1.0, *line["predictors"]] for line in lines])
        self.hit = np.array([float(line["overlap"] >= HIT_OVERLAP) for line in lines])
        self.lost = np.array([line["status"] == "lost" for line in lines])
        self.served = np.array([line["score"] for line in lines])

    def score(self, model):
        chance = 1 / (1 + np.exp(-self.rows @ model))
        return np.where(self.lost, np.minimum(chance, MAX_LOST), chance)


def loss_at(model, rows, hit, weight):
    """The loss, its slope and its curvature."""
    z = rows @ model
    chance = 1 / (1 + np.exp(-z))
    value = weight @ np.logaddexp(0, np.where(hit > 0, -z, z)) + RIDGE / 2 * model @ model
    slope = rows.T @ (weight * (chance - hit)) + RIDGE * model
    curvature = (rows.T * (weight * chance * (1 - chance))) @ rows + RIDGE * np.eye(len(model))
    return value, slope, curvature


def fit(sequences):
    """The coefficients, by Newton's method: a step that does not lower the loss is halved. None unless there are both
    hits and misses."""
    found = [sequence for sequence in sequences if not sequence.lost.all()]
    rows, hit = (np.concatenate([getattr(it, name)[~it.lost] for it in found]) for name in ("rows", "hit"))
    if hit.min() == hit.max():
        return None
    weight = np.concatenate([np.full(n, 1 / len(found) / n) for n in ((~it.lost).sum() for it in found)])
    model = np.zeros(rows.shape[1])
    value, slope, curvature = loss_at(model, rows, hit, weight)
    for _ in range(200):
        step = np.linalg.solve(curvature, slope)
        while loss_at(model - step, rows, hit, weight)[0] > value and abs(step).max() > 1e-12:
            step /= 2
        model = model - step
        value, slope, curvature = loss_at(model, rows, hit, weight)
        if abs(step).max() < 1e-9:
            break
    return model


def quality(score, hit):
    """The area under the ROC curve, and the expected calibration error in ten bins."""
    _, group = np.unique(score, return_inverse=True)
    hits, misses = np.bincount(group, hit), np.bincount(group, 1 - hit)
    pairs = hits.sum() * misses.sum()
    area = hits @ (np.cumsum(misses) - misses / 2) / pairs if pairs else float("nan")
    bins = np.minimum((score * 10).astype(int), 9)
    return area, abs(np.bincount(bins, score - hit)).sum() / len(score)


def row(name, score, hit, model=None):
    # Without both hits and misses there is no ROC curve.
    cells = ["-" if np.isnan(number) else f"{number:.3f}" for number in quality(score, hit)]
    cells += ["-"] * len(NAMES) if model is None else [f"{number:.2f}" for number in model]
    return "| " + " | ".join([name, *cells]) + " |"


def main():
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    by_name = {}
    for path in map(pathlib.Path, sys.argv[1:]):
        for line in map(json.loads, path.read_text().splitlines()):
            by_name.setdefault(f"{path.stem}/{line['sequence']}", []).append(line)
    names, sequences = list(by_name), [Frames(lines) for lines in by_name.values()]
    every = Frames(sum(by_name.values(), []))
    model = fit(sequences)
    if model is None:
        sys.exit("fit_score: there is nothing to fit: the frames must be hits (overlap >= 0.5) and misses, not one kind alone")
    print("| score | ROC area | calibration error | " + " | ".join(NAMES) + " |")
    print("|---|" + "---:|" * (2 + len(NAMES)))
    print(row("the tracker's", every.served, every.hit))
    print(row("fitted", every.score(model), every.hit, model))
    others = [fit(sequences[:i] + sequences[i + 1:]) for i in range(len(names)) if len(names) > 1]
    if others and all(model is not None for model in others):
        unseen = [sequence.score(model) for sequence, model in zip(sequences, others)]
        print(row("fitted to the others", np.concatenate(unseen), every.hit))
        for name, sequence, score, model in zip(names, sequences, unseen, others):
            print(row(f"without {name}", score, sequence.hit, model))
    print(f"\n{len(every.hit)} frames, {every.hit.sum():.0f} of them hits; fitted to the {(~every.lost).sum()} with the target not lost")


if __name__ == "__main__":
    main()
