#!/usr/bin/env python3
"""Loops, being lost and going on with a map over many rendered seeds, against the exact truth.

    .venv/bin/python bench/loop_seeds.py RESULTS.jsonl --ygslam build/release/ygslam \\
        --scratch DIR --rows ring,twin,kidnap --seeds 1-20
    .venv/bin/python bench/loop_seeds.py RESULTS.jsonl          # the tables of what is there

A seed of a row is rendered into DIR, run (deterministic, everything static, where no people are
about), and deleted; its figures are a line of RESULTS, and a seed whose line is there is not
repeated. A sequence that lies in DIR already (ring_1, twin_7, ...) is used as it is and stays. Rows:

ring      the long way around: ATE with loops and without; drift is how far from the truth the end of
          the trajectory without loops lies, its first pose on the truth's
ring_twice  the same, twice around
twin      twin_rooms_return: from room A through a corridor into B, which looks the same, and back.
          walk: all of it. kidnap: from somewhere in A to somewhere in B, four seconds without a
          frame, then on. restart: on from B with the map of A. merge: the map of A with that of B,
          which must not be joined
kidnap    the camera is put elsewhere for some seconds and brought back, each seed at another time
jump      a lap of unmoved_room, half a second without a frame, then some place of the second lap
sessions  office_evening placed in the map of office_day: other light, other people (true masks)
standing  ten minutes of walking_static, which is played to and fro (true masks): keyframes made
laps      unmoved_room, lap after lap (--laps): its two laps, each with its own noise, take turns
"""
import functools
import json
import math
import random
import shutil
import statistics
from pathlib import Path

from matrix import measured, parser_of
from rendered_seeds import (WRONG_M, Bench, Sequence, alignment, best_fit_rmse_m, count_frames,
                            count_loops, errors_m, read_tum, seed_range, to_and_fro)

SMALL = ["--size", "480x360"]
RIGHT_M = 0.1
CARRIED_S = 4        # from room A into B, the lens covered
LAP_FRAMES = 561     # of unmoved_room
TWICE_AROUND_S = "511"  # of ring


def ring(bench, seed):
    return closed_and_open(bench, bench.render(f"ring_{seed}", "ring", seed))


def ring_twice(bench, seed):
    twice = ["--seconds", TWICE_AROUND_S]
    return closed_and_open(bench, bench.render(f"ring_twice_{seed}", "ring", seed, *twice))


def closed_and_open(bench, sequence):
    figures = {}
    for name, without in (("closed", "dense_map"), ("open", "dense_map,loops")):
        out = bench.run(f"ring_{name}", sequence.folder, "--set", f"run.without=[{without}]")
        metrics = json.loads((out / "metrics.json").read_text())
        figures[f"{name}_mm"] = 1000 * metrics["ate"]["rmse"]
        if name == "closed":
            figures |= count_loops(out, sequence.truth())
        else:
            figures["drift_mm"] = 1000 * drift_m(read_tum(out / "trajectory.txt"), sequence.truth())
    return figures


def drift_m(poses, truth):
    return errors_m(poses, truth, alignment(poses, truth))[max(s for s in poses if s in truth)]


def jittered(seed, metres):
    dice = random.Random(seed)

    def change(config):
        for point in config["camera"]["waypoints"]:
            point[0] += dice.uniform(-metres, metres)
            point[1] += dice.uniform(-metres, metres)
    return change


def twin(bench, seed):
    world = bench.world("twin_rooms_return", jittered(seed, 0.1))
    walk = bench.render(f"twin_{seed}", world, seed, *SMALL)
    truth = walk.truth()
    rooms = "".join(walk.room(i) for i in range(len(walk.frames)))
    out_of_a, into_b = rooms.index("-"), rooms.index("B")
    out_of_b = rooms.index("-", into_b)
    a, b, from_b = walk.cut(0, out_of_a), walk.cut(into_b, out_of_b), walk.cut(into_b, None)
    figures = {}

    out = bench.run("twin_walk", walk.folder)
    poses = read_tum(out / "trajectory.txt")
    figures["walk"] = {"ate_mm": 1000 * best_fit_rmse_m(poses, truth), **count_loops(out, truth),
                       **count_frames(out, truth, alignment(poses, truth), list(truth))}

    dice = random.Random(seed)
    before = walk.cut(0, dice.randrange(out_of_a // 2, out_of_a))
    from_somewhere = walk.cut(dice.randrange(into_b, (into_b + out_of_b) // 2), None)
    kidnapped = before.then(from_somewhere, CARRIED_S)
    out = bench.run("twin_kidnap_out", bench.write("twin_kidnap", kidnapped))
    aligned = alignment(read_tum(out / "trajectory.txt"), truth)  # by the first frame of A
    in_b = len(from_somewhere.frames) - len(walk.frames) + out_of_b
    figures["kidnap"] = places(out, kidnapped, len(before.frames), in_b, aligned)
    figures["kidnap"] |= {"loops": count_loops(out, kidnapped.truth())}

    map_a, map_b = bench.folder("a.map"), bench.folder("b.map")
    mapped = bench.run("twin_a_out", bench.write("twin_a", a), "--save-map", map_a)
    out = bench.run("twin_restart_out", bench.write("twin_b_on", from_b), "--load-map", map_a)
    aligned = alignment(read_tum(mapped / "trajectory.txt"), truth)
    figures["restart"] = places(out, from_b, 0, len(b.frames), aligned)
    figures["restart"] |= {"loops": count_loops(out, truth)}

    bench.run("twin_b_out", bench.write("twin_b", b), "--save-map", map_b)
    figures["merge"] = merge(bench, map_a, map_b)
    return figures


def places(out, sequence, begin, count_in_room, aligned):
    """Frames in room B, and those after it."""
    truth = sequence.truth()
    stamps = [f[0] for f in sequence.frames[begin:]]
    return {"in_b": count_frames(out, truth, aligned, stamps[:count_in_room]),
            "after": count_frames(out, truth, aligned, stamps[count_in_room:])}


def merge(bench, first, second):
    merged = bench.folder("merged.map")
    done = bench.call("map", "merge", first, second, "-o", merged)
    return {"joined": done.returncode == 0,
            "said": (done.stdout + done.stderr).strip().splitlines()[-1:]}


def kidnap(bench, seed):
    dice = random.Random(seed)
    begin, away = dice.uniform(8, 11), dice.uniform(2, 4)

    def change(config):
        config["seconds"], config["fps"] = 18, 15
        config["camera"]["kidnaps"][0] |= {"from": begin, "until": begin + away}
    sequence = bench.render(f"kidnap_{seed}", bench.world("kidnap", change), seed, *SMALL)
    first = sequence.frames[0][0]
    back = next(i for i, f in enumerate(sequence.frames) if f[0] - first >= 1e6 * (begin + away))
    return found_again(bench, "kidnap_out", sequence.folder, sequence, back)


def jump(bench, seed):
    rendered = bench.render("unmoved_1", "unmoved_room", 1, *SMALL)  # the same for all seeds
    at = random.Random(seed).randrange(LAP_FRAMES, len(rendered.frames) - 60)
    sequence = rendered.cut(0, LAP_FRAMES).then(rendered.cut(at, at + 60), 0.5)
    folder = bench.write("jump", sequence)
    figures = found_again(bench, "jump_out", folder, sequence, LAP_FRAMES)
    shutil.rmtree(folder)
    bench.keep(rendered.folder.name)  # for the next seed
    return figures


def found_again(bench, name, folder, sequence, back):
    """How long until the first right pose after a known place came into view."""
    out = bench.run(name, folder)
    truth = sequence.truth()
    live = read_tum(out / "trajectory_live.txt")
    aligned = alignment(live, truth)
    off = errors_m(live, truth, aligned)
    stamps = [f[0] for f in sequence.frames]
    right = [s for s in stamps[back:] if off.get(s, math.inf) < RIGHT_M]
    return {"after_s": (right[0] - stamps[back]) / 1e6 if right else None,
            **count_frames(out, truth, aligned, stamps)}


def sessions(bench, seed):
    """Poses of the evening in the map of the day, against the truth in the day's frame."""
    how = [*SMALL, "--fps", "10", "--truth"]
    day = bench.render(f"day_{seed}", "office_day", seed, *how)
    evening = bench.render(f"evening_{seed}", "office_evening", seed, *how)

    def masked(sequence):
        return ["--deterministic", "--segmenter", f"masks:{sequence.folder / 'mask'}"]
    file = bench.folder("day.map")
    mapped = bench.run("day_out", day.folder, "--save-map", file, how=masked(day))
    placed = bench.run("evening_out", evening.folder, "--map", file, command="localize",
                       how=masked(evening))
    truth = evening.truth()
    aligned = alignment(read_tum(mapped / "trajectory.txt"), day.truth())
    found = read_tum(placed / "trajectory_live.txt")
    off = sorted(errors_m(found, truth, aligned).values())
    first = min(found) - evening.frames[0][0] if found else None
    return {"frames": len(evening.frames), "found": len(off), "first_s": first and first / 1e6,
            "median_mm": 1000 * statistics.median(off) if off else None,
            "rmse_mm": 1000 * math.sqrt(statistics.mean(e * e for e in off)) if off else None,
            "max_mm": 1000 * max(off) if off else None, "wrong": sum(e > WRONG_M for e in off)}


def standing(bench, seed):
    """Keyframes that were made, also those that went again, after a minute and after ten."""
    fps = 5
    people = bench.render(f"standing_{seed}", "walking_static", seed, *SMALL,
                          "--fps", str(fps), "--truth")
    count = 10 * 60 * fps
    folder, file = bench.folder("to_and_fro"), bench.folder("standing.map")
    to_and_fro(people, folder, count)
    figures = {"frames": count}
    for name, end in (("minute", count // 10), ("ten", count)):
        out = bench.run("standing_out", folder, "--save-map", file, "--to", str(end),
                        how=["--deterministic", "--segmenter", f"masks:{folder / 'mask'}"])
        metrics = json.loads((out / "metrics.json").read_text())
        info = json.loads(bench.call("map", "info", file, "--json").stdout)
        figures |= {f"{name}_made": info["keyframes"] + info["removed_keyframes"],
                    f"{name}_kept": info["keyframes"], f"{name}_landmarks": info["landmarks"],
                    f"{name}_bytes": info["bytes"], f"{name}_coverage": metrics["coverage"]}
        file.unlink()
    return figures


def laps(bench, seed):
    two = bench.render(f"unmoved_{seed}", "unmoved_room", seed, *SMALL).cut(0, 2 * LAP_FRAMES)
    step = two.frames[1][0] - two.frames[0][0]
    frames = [(10**9 + step * i, *two.frames[i % len(two.frames)][1:])
              for i in range(bench.options.laps * LAP_FRAMES)]
    file, figures = bench.folder("laps.map"), {"laps": bench.options.laps}
    for name, count in (("third", 3), ("last", bench.options.laps)):
        part = Sequence(two.folder, frames[:count * LAP_FRAMES])
        out = bench.run(f"laps_{name}_out", bench.write(f"laps_{name}", part), "--save-map", file)
        metrics = json.loads((out / "metrics.json").read_text())
        live, last = read_tum(out / "trajectory_live.txt"), part.frames[-LAP_FRAMES:]
        last_lap = {f[0]: live[f[0]] for f in last if f[0] in live}
        figures[name] = {
            "keyframes": metrics["keyframes"], "landmarks": metrics["landmarks"],
            "coverage": metrics["coverage"], "peak_rss_mb": metrics["peak_rss_mb"],
            "map_mb": file.stat().st_size / 1e6,
            "lap_mm": 1000 * best_fit_rmse_m(last_lap, part.truth()),
            **count_loops(out, part.truth())}
    return figures


ROWS = {"ring": ring, "ring_twice": ring_twice, "twin": twin, "kidnap": kidnap, "jump": jump,
        "sessions": sessions, "standing": standing, "laps": laps}


def spread(values, unit=""):
    """Median and both ends."""
    if not values:
        return "-"
    return (f"{statistics.median(values):.4g}{unit} "
            f"({min(values):.4g} to {max(values):.4g})")


def report_ring(name, runs):
    print(f"{name}, {len(runs)} seeds: ATE [mm] closed {spread([r['closed_mm'] for r in runs])}, "
          f"open {spread([r['open_mm'] for r in runs])}, "
          f"ratio {spread([r['closed_mm'] / r['open_mm'] for r in runs])}; drift of the open one "
          f"[mm] {spread([r['drift_mm'] for r in runs if 'drift_mm' in r])}; "
          f"loops {sum(r['closed'] for r in runs)}, false {sum(r['false'] for r in runs)}")


def report_twin(runs):
    n = len(runs)
    walks = [r["walk"] for r in runs]
    whole = [w for w in walks if w["live_tracked"] == w["frames"]]
    print(f"twin walk, {n} seeds: loops {sum(w['closed'] for w in walks)}, "
          f"false {sum(w['false'] for w in walks)}; never lost in {len(whole)}: of these the way "
          f"back found in {sum(w['closed'] > w['false'] for w in whole)}, ATE [mm] "
          f"{spread([w['ate_mm'] for w in whole])}; frames of another place "
          f"{sum(w['final_wrong'] for w in walks)} and "
          f"{sum(w['final_wrong_marked'] for w in walks)} marked provisional")
    for case in ("kidnap", "restart"):
        for part in ("in_b", "after"):
            total = {k: sum(r[case][part][k] for r in runs) for k in runs[0][case][part]}
            print(f"twin {case}, {part}: {total}")
        print(f"twin {case}: false loops {sum(r[case]['loops']['false'] for r in runs)}")
    print(f"twin merge of A and B: joined {sum(r['merge']['joined'] for r in runs)} of {n}")


def report_found(name, runs):
    times = [r["after_s"] for r in runs if r["after_s"] is not None]
    print(f"{name}, {len(runs)} seeds: found again in {len(times)} after [s] {spread(times)}; "
          f"frames delivered of another place: {sum(r['live_wrong'] for r in runs)} and "
          f"{sum(r['live_wrong_marked'] for r in runs)} marked provisional")


def report_sessions(runs):
    print(f"sessions, {len(runs)} seeds: recall [%] "
          f"{spread([100 * r['found'] / r['frames'] for r in runs])}, first after [s] "
          f"{spread([r['first_s'] for r in runs if r['found']])}; [mm] median "
          f"{spread([r['median_mm'] for r in runs if r['found']])}, RMSE "
          f"{spread([r['rmse_mm'] for r in runs if r['found']])}, max "
          f"{spread([r['max_mm'] for r in runs if r['found']])}; of another place "
          f"{sum(r['wrong'] for r in runs)}")


def report_standing(runs):
    for r in runs:
        print(f"standing, seed {r['seed']}: keyframes made in a minute {r['minute_made']} (kept "
              f"{r['minute_kept']}), in ten {r['ten_made']} ({r['ten_kept']}); landmarks "
              f"{r['minute_landmarks']}, {r['ten_landmarks']}; coverage {r['ten_coverage']:.4f}")


def report_laps(runs):
    for r in runs:
        for name in ("third", "last"):
            p = r[name]
            print(f"laps, seed {r['seed']}, after lap {3 if name == 'third' else r['laps']}: "
                  f"{p['keyframes']} keyframes, {p['landmarks']} landmarks, file {p['map_mb']:.1f} "
                  f"MB, peak memory {p['peak_rss_mb']:.0f} MB, ATE of its last lap "
                  f"{p['lap_mm']:.1f} mm, coverage {p['coverage']:.4f}, loops {p['closed']}, "
                  f"false {p['false']}")


def report(lines):
    for row, print_row in (("ring", lambda runs: report_ring("ring", runs)),
                           ("ring_twice", lambda runs: report_ring("ring twice", runs)),
                           ("twin", report_twin),
                           ("kidnap", lambda runs: report_found("kidnap", runs)),
                           ("jump", lambda runs: report_found("jump", runs)),
                           ("sessions", report_sessions), ("standing", report_standing),
                           ("laps", report_laps)):
        runs = [line for line in lines if line["row"] == row]
        if runs:
            print_row(runs)


def measure(options, row, seed):
    with Bench(options) as bench:
        return {"row": row, "seed": seed, **ROWS[row](bench, seed)}


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--scratch", type=Path, help="folder for what is rendered, and deleted")
    parser.add_argument("--rows", default="", help=",".join(ROWS))
    parser.add_argument("--seeds", default="1-20", help="FIRST-LAST, or one")
    parser.add_argument("--laps", type=int, default=40)
    options = parser.parse_args()
    rows = [row for row in options.rows.split(",") if row]
    if rows and not (options.ygslam and options.scratch):
        parser.error("--ygslam and --scratch: with which program, where?")
    if unknown := [row for row in rows if row not in ROWS]:
        parser.error(f"--rows: {unknown[0]} is none of {', '.join(ROWS)}")
    jobs = {(row, seed): functools.partial(measure, options, row, seed)
            for row in rows for seed in seed_range(options.seeds)}
    report(measured(options.results, lambda line: (line["row"], line["seed"]), jobs))


if __name__ == "__main__":
    main()
