"""Ours beside NVIDIA Warp and Taichi: steps of the same network, from one run; see README.md for the policy of the numbers."""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


def run(words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{words}: {done.stderr}")
    # Taichi and Warp greet on stdout
    return json.loads(done.stdout[done.stdout.index("\n{") + 1 if not done.stdout.startswith("{") else 0:])


def ours(size, threads, arguments):
    words = [arguments.springfit, "bench", "step", "--sizes", size, "--threads", threads, "--repeat", arguments.repeat]
    rows = run([*words, "--json", *damping(arguments)])["rows"]
    row = next(row for row in rows if row["threads"] == threads)
    seconds = row["whole_step"]
    return {"rounds": seconds["rounds"], "processor": seconds["processor_rounds"], "error": 0.0, "version": "springfit"}


def damping(arguments):
    return ["--alpha", arguments.alpha] if arguments.alpha else []


def contestants(size, threads, arguments):
    """Name and a function that takes one turn."""
    prefix = arguments.out / f"step_{size}"
    yield "springfit, f64", lambda: ours(size, threads, arguments)
    for precision in ("f32", "f64"):
        for way in ("springs", "nodes"):
            words = [prefix, arguments.repeat, precision, way]
            yield (f"warp, {precision}, by {way}, 1 thread",
                   lambda words=words: run([sys.executable, HERE / "step_warp.py", *words]))
            yield (f"taichi, {precision}, by {way}",
                   lambda words=words: run([sys.executable, HERE / "step_taichi.py", *words, threads]))


def compare(size, threads, arguments):
    """All turns of all contestants on one network."""
    rows, springs = {}, json.loads((arguments.out / f"step_{size}.json").read_text())["springs"]
    for _ in range(arguments.turns):
        for name, turn in contestants(size, threads, arguments):
            found = turn()
            row = rows.setdefault(name, found | {"rounds": [], "processor": [], "load": []})
            row["rounds"] += found["rounds"]
            row["processor"] += found["processor"]
            row["load"].append(os.getloadavg()[0])
    for row in rows.values():
        row |= {"size": size, "threads": threads, "springs": springs}
        seconds = {"median": statistics.median(row["rounds"]), "least": min(row["rounds"]),
                   "processor": statistics.median(row["processor"])}
        row["millions"] = {key: springs / value / 1e6 for key, value in seconds.items()}
    for key in ("median", "least", "processor"):
        better = max(row["millions"][key] for name, row in rows.items() if not name.startswith("springfit"))
        for row in rows.values():
            row.setdefault("ratio", {})[key] = row["millions"][key] / better
    return [{"name": name, **row} for name, row in rows.items()]


def table(rows):
    yield (f"{'n':>3} {'springs':>8} {'thr':>3} {'program':<32} {'median':>7} {'ratio':>6} {'best':>7} {'ratio':>6} "
           f"{'process.':>8} {'ratio':>6} {'error':>8} {'load':>5}   (millions of springs a second, whole steps)")
    for r in rows:
        rates = " ".join(f"{r['millions'][key]:>{7 + (key == 'processor')}.1f} {r['ratio'][key]:>6.2f}"
                         for key in ("median", "least", "processor"))
        yield (f"{r['size']:>3} {r['springs']:>8} {r['threads']:>3} {r['name']:<32} {rates} {r['error']:>8.1e} "
               f"{statistics.mean(r['load']):>5.1f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="17,33")
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--alpha", type=float, help="damping (4.18); none when absent")
    parser.add_argument("--repeat", type=int, default=5, help="timed rounds in a turn")
    parser.add_argument("--turns", type=int, default=3, help="how often ours and theirs alternate")
    parser.add_argument("--springfit", type=Path, default=ROOT / "target/release/springfit")
    parser.add_argument("--out", type=Path, default=Path("peers-out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for size in map(int, arguments.sizes.split(",")):
        run([arguments.springfit, "bench", "step", "--sizes", size, "--repeat", 1, "--threads", 1, "--json", "--write",
             arguments.out, *damping(arguments)])
        for threads in map(int, arguments.threads.split(",")):
            rows += (new := compare(size, threads, arguments))
            print("\n".join(table(new)), flush=True)
    for version in sorted({row["version"] for row in rows}):
        print(version)
    (arguments.out / "step.json").write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
