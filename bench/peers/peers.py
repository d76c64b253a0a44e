"""Seconds to an RMS error of 5, 1 and 0.3 %: clrad, Mitsuba 3 and Radiance, on the reference rooms, at the reference's points
and all over the surfaces. `./run bench peers` starts it.

Each tool has a written grid of settings (below). All of it is run, and of the settings whose error is within the target the
fastest is kept; then the tools take turns at those, and the median is what is printed. Loading, compilation (Mitsuba's second
run in a process, clrad's likewise) and start-up (of rtrace, by a run that asks for nothing) are left out. The error of a tool
that has chance in it is the root mean square over a few seeds.
"""
import argparse
import itertools
import json
import math
import os
import pathlib
import sys
import time

import numpy as np

import clrad_tool
import mitsuba_tool
import radiance_tool
from rooms import rms, rooms

TARGETS = (0.05, 0.01, 0.003)
ROUNDS = 5  # of the turns
LONG = 40.0  # seconds; runs expected to take longer are not made: of tools whose error is chance alone, it and their time
# are scaled from the longest that was, and marked so

STRATIFIED = [k * k for k in (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512)]
"""Samples a point: squares, and about twice as many each time."""


def mitsuba_families():
    """Mitsuba's own path integrator on cosine-distributed rays; and paths whose first direct light is sampled at the point itself."""
    yield {"strategy": "path", "sampler": "stratified"}
    for sampler, direct, roulette in (("independent", 1, 5), ("stratified", 1, 5), ("multijitter", 1, 5),
                                      ("stratified", 1, 2), ("stratified", 2, 3), ("stratified", 4, 5)):
        yield {"strategy": "split", "sampler": sampler, "direct": direct, "roulette": roulette}


def radiance_grid(what):
    """Without its cache hemispheres are sampled anew at every point; with it (-aa above 0) they are kept and interpolated."""
    if what == "points":
        for direct, bounces, all_rays in ((0, 4, (16, 64)), (0, 8, (64, 256)), (4, 8, (64, 256, 1024)),
                                          (4, 14, (256, 1024, 4096, 16384)), (8, 14, (1024, 4096, 16384))):
            for rays in all_rays:
                yield {"-aa": 0, "-ab": bounces, "-ad": rays, "-as": 0, "-ds": 0.2 if direct else 0.05, "direct": direct}
        return
    for (accuracy, rays), bounces, direct in itertools.product(
            ((0.6, 32), (0.4, 64), (0.3, 128), (0.2, 256), (0.15, 1024)), (4, 8), (0, 2)):
        yield {"-aa": accuracy, "-ar": 32, "-ab": bounces, "-ad": rays, "-as": rays // 2, "-ds": 0.2 if direct else 0.05,
               "direct": direct}
    for rays in (16, 64, 256):
        yield {"-aa": 0, "-ab": 6, "-ad": rays, "-as": 0, "-ds": 0.05, "direct": 0}


def clrad_grid(what):
    """Of points the gather alone is to be careful, over the whole scene the mesh and the shadows. Lengths are shares of the
    scene's extent."""
    if what == "points":
        for (patches, elements), converge, rays in itertools.product(
                ((1, 2), (2, 4), (2, 8), (4, 8), (4, 16), (8, 16), (8, 32), (16, 32), (16, 64)), (1e-2, 1e-3),
                (256, 2048, 16384)):
            yield {"patches": patches, "elements": elements, "light samples": 64, "converge": converge, "sensor rays": rays}
        return
    meshes = ((4, 8), (4, 16), (4, 32), (8, 16), (8, 32), (8, 64), (12, 48), (16, 64), (16, 128), (24, 96), (32, 128))
    for (patches, elements), converge, (samples, light) in itertools.product(meshes, (1e-2, 1e-3), ((2, 64), (4, 256))):
        yield {"patches": patches, "elements": elements, "converge": converge, "samples": samples, "light samples": light}
    for (patches, elements), tolerance in itertools.product(((4, 16), (8, 16), (8, 32), (16, 32)), (0.1, 0.03, 0.01)):
        yield {"patches": patches, "elements": elements, "adaptive": tolerance, "levels": 3}


def clrad_targets():
    """What a user does who does not know the grid."""
    for target in TARGETS:
        yield {"target": target}


class Row:
    def __init__(self, tool, settings, error, seconds, extrapolated=False):
        self.tool, self.settings, self.error, self.seconds = tool, settings, error, seconds
        self.extrapolated = extrapolated


def measure(tool, points, settings, seeds, limit=None):
    """None when it took longer than `limit`."""
    squares, seconds = [], []
    for seed in range(seeds):
        values, took = tool.run(points, settings, seed, limit)
        if values is None:
            return None
        squares.append(rms(values, points) ** 2)
        seconds.append(took)
        if sum(seconds) > LONG / 3:
            break
    row = Row(tool.name, settings, math.sqrt(np.mean(squares)), float(np.median(seconds)))
    say(f"    {row.tool:<22} {100 * row.error:8.3f} %  {row.seconds:9.4f} s  {settings}")
    return row


def sweep_mitsuba(tool, points, what, seeds):
    """Each family at few samples; the best by time x error^2, which does not depend on how many there are, and the next where it is
    about as good, at all."""
    pilot = {"points": 256, "scene": 16}[what]
    pilots = []
    for family in mitsuba_families():
        settings = {**family, "samples": pilot}
        tool.run(points, settings, 99)
        pilots.append(measure(tool, points, settings, max(3, seeds)))

    def merit(row):
        return row.seconds * row.error**2

    pilots.sort(key=merit)
    rows = list(pilots)
    for row in pilots[:2] if merit(pilots[1]) < 1.25 * merit(pilots[0]) else pilots[:1]:
        for samples in STRATIFIED:
            settings = {**row.settings, "samples": samples}
            if row.seconds * samples / row.settings["samples"] > LONG:
                break
            if samples == pilot:
                continue
            if samples < pilot:
                tool.run(points, settings, 99)
            rows.append(measure(tool, points, settings, seeds))
            if rows[-1].error < 0.8 * TARGETS[-1]:
                break
        family = {**row.settings, "samples": 0}
        last = max((r for r in rows if {**r.settings, "samples": 0} == family), key=lambda r: r.settings["samples"])
        for target in TARGETS:
            more = (last.error / target) ** 2
            if more > 1:
                settings = {**last.settings, "samples": math.ceil(more * last.settings["samples"])}
                rows.append(Row(tool.name, settings, target, more * last.seconds, extrapolated=True))
    return rows


def sweep_grid(tool, points, grid, seeds, budget):
    """All of it that `budget` seconds are enough for."""
    rows, begin = [], time.monotonic()
    for settings in grid:
        if time.monotonic() - begin > budget:
            say(f"    {tool.name}: out of time, the rest of its grid is left out")
            break
        try:
            row = measure(tool, points, settings, seeds, LONG)
        except RuntimeError as trouble:
            say(f"    {trouble}")
            continue
        if row:
            rows.append(row)
        else:
            say(f"    {tool.name}: over {LONG:g} s with {settings}")
    return rows


def fastest(rows, target):
    good = [row for row in rows if row.error <= target and row.settings.get("target", target) == target]
    return min(good, key=lambda row: row.seconds) if good else None


def reference(room, tool, clrad, folder, quick):
    """Irradiance all over by two long runs of Mitsuba that know nothing of each other: with both, chance in them cancels (rms()).
    Kept in a file, made once."""
    points, samples = room.everywhere, 256 if quick else 4096
    file = folder / f"{room.id}-{samples}.npz"
    if not file.exists():
        say(f"  {room.id}: making the reference all over the surfaces, {samples} paths a point, twice")
        halves = [tool.run(points, {"strategy": "split", "sampler": "stratified", "direct": 1, "roulette": 5,
                                    "samples": samples}, 10**4 + k)[0] for k in range(2)]
        np.savez(file, halves=np.stack(halves))
    points.halves = np.load(file)["halves"]
    mean = points.halves.mean()
    own = math.sqrt(np.mean((points.halves[0] - points.halves[1]) ** 2)) / 2 / mean
    fine = {"patches": 16, "elements": 64 if quick else 128, "samples": 8, "light samples": 1024, "converge": 1e-4}
    apart = measure(clrad, points, fine, 1)
    say(f"  {room.id}: {len(points.position)} points all over; the reference's standard error {100 * own:.3f} %, taken out of all "
        f"errors; a finely meshed clrad solve is {100 * apart.error:.3f} % from it")
    return {"case": room.id, "points": len(points.position), "standard_error": own, "clrad_fine_apart": apart.error,
            "clrad_fine": fine}


def turns(tools, rows, points, rounds):
    """Median seconds of each of `rows`, the tools in turn; slower ones have fewer turns, long and extrapolated ones keep the time
    that they have."""
    again = [row for row in rows if row and not row.extrapolated and row.seconds < LONG / 8]
    seconds = {id(row): [] for row in again}
    for k in range(rounds + 1):  # the first warms up
        for row in again:
            if k > 2 and k * row.seconds > LONG / 4:
                continue
            _, took = tools[row.tool].run(points, row.settings, k)
            if k > 0:
                seconds[id(row)].append(took)
    for row in again:
        row.seconds = float(np.median(seconds[id(row)]))


def markdown(rows):
    tools = list(dict.fromkeys(row["tool"] for row in rows))
    lines = ["| | RMS error | " + " | ".join(f"{tool} [s]" for tool in tools) + " |",
             "| --- | --- |" + " --- |" * len(tools)]
    for case, what, target in dict.fromkeys((r["case"], r["what"], r["target"]) for r in rows):
        cells = []
        for tool in tools:
            row = next((r for r in rows if (r["case"], r["what"], r["target"], r["tool"]) == (case, what, target, tool)), None)
            cells.append("not met" if row is None or row["seconds"] is None else
                         f"{'≈ ' if row['extrapolated'] else ''}{row['seconds']:.2g}")
        where = {"points": "at the reference's points", "scene": "all over"}[what]
        lines.append(f"| {case}, {where} | {100 * target:g} % | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def say(text):
    print(text, file=sys.stderr, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", default="out/bench/peers.json")
    parser.add_argument("--program", required=True, help="bench_peers")
    parser.add_argument("--folder", default="out/peers", help="for scenes and references")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="coarse reference, the block room's points and whole only")
    parser.add_argument("--case", help="part of the name of the only room")
    parser.add_argument("--what", choices=("points", "scene"), help="the only question")
    arguments = parser.parse_args()
    folder = pathlib.Path(arguments.folder)
    allowed = sorted(os.sched_getaffinity(0))[:arguments.cores]
    os.sched_setaffinity(0, allowed)  # children have the same
    cores = len(allowed)
    budget = 20 if arguments.quick else 90

    rows, references, tried = [], [], []
    for room in rooms():
        if arguments.case and arguments.case not in room.id or arguments.quick and "block" not in room.id:
            continue
        tools = {tool.name: tool for tool in (clrad_tool.Tool(room, cores, arguments.program, folder),
                                              clrad_tool.Tool(room, cores, arguments.program, folder, "clrad --target-error"),
                                              mitsuba_tool.Tool(room, cores), radiance_tool.Tool(room, cores, folder))}
        clrad, clrad_told, mitsuba, radiance = tools.values()
        for what in ("points", "scene"):
            if arguments.what not in (None, what):
                continue
            say(f"{room.id}, {what}")
            points = room.points if what == "points" else room.everywhere
            seeds = {"points": 4, "scene": 1}[what]
            for tool in (clrad, clrad_told):
                tool.run(points, {"patches": 2, "elements": 8}, 0)  # builds kernels
            if what == "scene":
                references.append(reference(room, mitsuba, clrad, folder, arguments.quick))
            found = {
                clrad.name: sweep_grid(clrad, points, clrad_grid(what), min(seeds, 2), budget),
                clrad_told.name: sweep_grid(clrad_told, points, clrad_targets(), min(seeds, 2), budget),
                mitsuba.name: sweep_mitsuba(mitsuba, points, what, seeds),
                radiance.name: sweep_grid(radiance, points, radiance_grid(what), seeds, budget),
            }
            tried += [{"case": room.id, "what": what, "tool": row.tool, "settings": row.settings, "rms": row.error,
                       "seconds": row.seconds, "extrapolated": row.extrapolated} for all in found.values() for row in all]
            for target in TARGETS:
                best = {name: fastest(of, target) for name, of in found.items()}
                turns(tools, list(best.values()), points, 1 if arguments.quick else ROUNDS)
                for name, row in best.items():
                    rows.append({"case": room.id, "what": what, "target": target, "tool": name,
                                 "settings": row.settings if row else None, "rms": row.error if row else None,
                                 "seconds": row.seconds if row else None, "extrapolated": bool(row and row.extrapolated)})
        for tool in tools.values():
            getattr(tool, "close", lambda: None)()

    for r in rows:
        say(f"{r['case']}, {r['what']}, {100 * r['target']:g} %: {r['tool']}: {r['settings']}")
    print(markdown(rows))
    print("≈: scaled by 1/sqrt(samples) from a shorter run")
    out = pathlib.Path(arguments.o)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps({"benchmark": "peers", "cores": cores, "load": os.getloadavg()[0], "rows": rows,
                               "references": references, "tried": tried}, indent=1) + "\n")


if __name__ == "__main__":
    main()
