#!/usr/bin/env python3
"""panonav evaluate against evo's rules (pairs of nearest stamps, Umeyama's alignment, parts of the path) by hand in
numpy, on trajectory pairs that are made at random: test_evaluate.py PANONAV. Exits with 77 (skipped) without numpy.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy
except ImportError:
    sys.exit(77)

PANONAV = sys.argv[1]
RANDOM = numpy.random.default_rng(7)


def align(x, y, with_scale):
    """Umeyama 1991, eq. 34-43: rotation, translation and scale that take the rows of x to those of y."""
    x0, y0 = x - x.mean(0), y - y.mean(0)
    u, d, vt = numpy.linalg.svd(y0.T @ x0 / len(x))
    s = numpy.diag([1, 1, numpy.sign(numpy.linalg.det(u) * numpy.linalg.det(vt))])
    scale = numpy.trace(numpy.diag(d) @ s) / (x0**2).sum(1).mean() if with_scale else 1.0
    rotation = u @ s @ vt
    return rotation, y.mean(0) - scale * rotation @ x.mean(0), scale


def pair(estimate_s, truth_s, largest_s):
    """Indices of both: each stamp of the shorter list and the nearest of the other."""
    swapped = len(estimate_s) > len(truth_s)
    short, long = (truth_s, estimate_s) if swapped else (estimate_s, truth_s)
    found = [(i, int(numpy.argmin(abs(long - s)))) for i, s in enumerate(short)]
    found = [(i, k) for i, k in found if abs(long[k] - short[i]) <= largest_s]
    return [(k, i) if swapped else (i, k) for i, k in found]


def random_rotation():
    q, r = numpy.linalg.qr(RANDOM.normal(size=(3, 3)))
    q = q * numpy.sign(numpy.diag(r))
    return q * numpy.sign(numpy.linalg.det(q))


def to_matrix(q):
    x, y, z, w = q / numpy.linalg.norm(q)
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def angle(rotation):
    """The angle of a rotation matrix: its sine from the antisymmetric part, its cosine from the trace."""
    axis = [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    return numpy.arctan2(numpy.linalg.norm(axis), numpy.trace(rotation) - 1)


def write_tum(path, stamps, points, quaternions=None):
    if quaternions is None:
        quaternions = numpy.tile([0.0, 0, 0, 1], (len(points), 1))
    lines = [" ".join(f"{v:.9f}" for v in (s, *p, *q)) for s, p, q in zip(stamps, points, quaternions)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return numpy.array([[float(v) for v in line.split()] for line in lines])


def evaluate(folder, *options):
    ran = subprocess.run([PANONAV, "evaluate", folder / "e.tum", folder / "t.tum", "--json", *options],
                         capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


def relative_errors(estimate, truth, part_m):
    """Errors of position and rotation over consecutive parts of the estimated path; poses are (position, matrix)."""
    ends, travelled = [], 0.0
    for i in range(1, len(estimate)):
        travelled += numpy.linalg.norm(estimate[i][0] - estimate[i - 1][0])
        if travelled >= part_m:
            ends.append(i)
            travelled = 0.0

    def motion(poses, a, b):
        return poses[a][1].T @ (poses[b][0] - poses[a][0]), poses[a][1].T @ poses[b][1]
    errors = []
    for a, b in zip(ends, ends[1:]):
        (p, p_turn), (q, q_turn) = motion(estimate, a, b), motion(truth, a, b)
        errors.append((numpy.linalg.norm(p - q), angle(p_turn.T @ q_turn)))
    return numpy.array(errors).reshape(-1, 2)


def rms(values):
    return numpy.sqrt(numpy.square(values).mean())


def check(folder, estimate_s, estimate, truth_s, truth, turns=(None, None), part_m=1.0):
    e = write_tum(folder / "e.tum", estimate_s, estimate, turns[0])
    t = write_tum(folder / "t.tum", truth_s, truth, turns[1])
    pairs = pair(e[:, 0], t[:, 0], 0.01)
    x, y = (numpy.array([rows[p[k], 1:4] for p in pairs]) for k, rows in ((0, e), (1, t)))
    x_turn, y_turn = ([to_matrix(rows[p[k], 4:]) for p in pairs] for k, rows in ((0, e), (1, t)))
    for kind in ("rigid", "similarity", "none"):
        rotation, shift, scale = align(x, y, kind == "similarity")
        if kind == "none":
            rotation, shift, scale = numpy.eye(3), numpy.zeros(3), 1.0
        moved, turned = scale * x @ rotation.T + shift, [rotation @ r for r in x_turn]
        answer = evaluate(folder, "--align", kind, "--relative-distance-m", str(part_m))
        assert answer["pairs"] == len(pairs), (answer["pairs"], len(pairs))
        expected = rms(numpy.linalg.norm(moved - y, axis=1))
        assert abs(answer["ate_m"]["rmse"] - expected) < 5e-8, (kind, answer["ate_m"], expected)
        if answer["rotation_rad"]:
            expected = rms([angle(b.T @ a) for a, b in zip(turned, y_turn)])
            assert abs(answer["rotation_rad"]["rmse"] - expected) < 1e-7, (kind, answer["rotation_rad"], expected)
        errors = relative_errors(list(zip(moved, turned)), list(zip(y, y_turn)), part_m)
        assert answer["relative_pairs"] == len(errors), (kind, answer["relative_pairs"], len(errors))
        if len(errors) > 0:
            for key, column in (("rpe_m", 0), ("rpe_rotation_rad", 1)):
                assert abs(answer[key]["rmse"] - rms(errors[:, column])) < 1e-7, (kind, key, answer[key])
    return evaluate(folder)


def odd_pair(number):
    """Stamps, positions and quaternions of an estimate and of the truth at other rates, with an offset of the clocks,
    a gap, drift, noise and another scale."""
    rates, span_s = [(5, 100), (100, 5), (30, 29.97), (20, 20), (7, 200)][number % 5], 12.0
    stamps = [numpy.arange(0.0, span_s, 1.0 / rate) for rate in rates]
    stamps[0] = stamps[0] + RANDOM.uniform(-0.009, 0.009)
    gap = RANDOM.uniform(2, 6)
    stamps[number % 2] = stamps[number % 2][abs(stamps[number % 2] - gap - 1.5) > 1.5]

    def curve(s):
        return numpy.stack([3 * numpy.cos(0.5 * s), 2 * numpy.sin(0.7 * s), 0.3 * numpy.sin(1.3 * s)], 1)

    def turn(s, noise):
        q = numpy.stack([0.2 * numpy.sin(s), 0.1 * numpy.cos(s), numpy.sin(0.4 * s), numpy.cos(0.4 * s)], 1)
        q = q + RANDOM.normal(scale=noise, size=q.shape)
        return q / numpy.linalg.norm(q, axis=1)[:, None]
    estimate = RANDOM.uniform(0.3, 3) * (curve(stamps[0]) + 0.02 * stamps[0][:, None]
                                         + RANDOM.normal(scale=0.03, size=(len(stamps[0]), 3))) @ random_rotation().T
    base_s = 1.7e9 * (number % 2)
    return (stamps[0] + base_s, estimate, stamps[1] + base_s, curve(stamps[1]),
            (turn(stamps[0], 0.05), turn(stamps[1], 0.0)))


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for number in range(8):
            count = 60
            truth_s = numpy.cumsum(RANDOM.uniform(0.02, 0.1, count)) + 1.7e9 * (number % 2)
            truth = numpy.cumsum(RANDOM.normal(size=(count, 3)) * [1, 0.7, 0.2], axis=0)
            keep = numpy.sort(RANDOM.choice(count, count - 7 * (number % 3), replace=False))
            noise = RANDOM.normal(scale=0.1, size=(len(keep), 3))
            scale = RANDOM.uniform(0.5, 2)
            estimate = scale * (truth[keep] + noise) @ random_rotation().T + RANDOM.normal(scale=9, size=3)
            if number >= 6:  # a mirror image, which no rotation aligns
                estimate[:, 1] *= -1
            estimate_s = truth_s[keep] + RANDOM.uniform(-0.012, 0.012, len(keep))
            order = numpy.argsort(estimate_s)
            check(folder, estimate_s[order], estimate[order], truth_s, truth)
        for number in range(10):
            check(folder, *odd_pair(number), part_m=RANDOM.choice([0.1, 1.0, 2.5]))
        # On a straight line rotations about it are all alike: the errors are unique, the rotation is not.
        line = numpy.outer(numpy.arange(20), [0.3, -0.4, 1.2])
        answer = check(folder, numpy.arange(20), line[::-1] @ random_rotation().T + 3, numpy.arange(20), line)
        assert answer["rotation_rad"] is None
    print("ATE and RPE of 19 pairs of trajectories are those of numpy")


main()
