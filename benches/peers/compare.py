"""Ours beside CHOLMOD and MKL PARDISO, from one run; see README.md for the policy of the numbers."""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


def environment(threads):
    """Everything that could make a library slower than it is, removed; threads fixed."""
    env = {k: v for k, v in os.environ.items() if k not in ("OPENBLAS_CORETYPE", "MKL_ENABLE_INSTRUCTIONS")}
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        env[name] = str(threads)
    if threads == 1:
        env |= {"OMP_THREAD_LIMIT": "1", "MKL_THREADING_LAYER": "SEQUENTIAL"}
    else:
        env |= {"MKL_THREADING_LAYER": "INTEL", "MKL_DYNAMIC": "FALSE"}
    return env


def run(words, threads):
    done = subprocess.run([str(word) for word in words], env=environment(threads), capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{words}: {done.stderr}")
    return json.loads(done.stdout)


class System:
    """The matrix of one size, for the peers and for the errors."""

    def __init__(self, folder, size):
        self.size, self.prefix = size, str(folder / f"cube_{size}")
        self.matrix = scipy.sparse.csr_matrix(scipy.io.mmread(self.prefix + ".mtx"))
        self.matrix.sort_indices()
        self.right = np.ravel(scipy.io.mmread(self.prefix + "_rhs.mtx"))
        upper = scipy.sparse.triu(self.matrix, format="csr")
        np.savez(self.prefix + ".npz", indptr=upper.indptr, indices=upper.indices, data=upper.data, right=self.right)

    def errors(self, solution):
        residual = np.abs(self.right - self.matrix @ solution)
        scale = abs(self.matrix) @ np.abs(solution) + np.abs(self.right)
        return float(np.linalg.norm(residual) / np.linalg.norm(self.right)), float((residual / scale).max())


def ours(system, method, threads, arguments):
    words = [arguments.springfit, "bench", "solve", "--sizes", system.size, "--methods", method, "--repeat", arguments.repeat]
    row = run([*words, "--threads", threads, "--json"], threads)["rows"][0]
    return {"rounds": row["evaluation"]["rounds"], "processor": row["evaluation"]["processor_rounds"],
            "analyse": row["analyse"]["median"], "residual": row["residual"], "backward_error": row["backward_error"],
            "factor_bytes": row["factor_bytes"], "flop": row["flop"], "kernel": "springfit"}


def peer(system, name, words, threads):
    found = run(words, threads)
    residual, backward_error = system.errors(np.fromfile(f"{system.prefix}_{name}.x"))
    return {"rounds": [sum(times) for times in zip(found["refactor"], found["solve"])],
            "residual": residual, "backward_error": backward_error,
            **{key: found[key] for key in ("analyse", "processor", "factor_bytes", "flop", "kernel")}}


def contestants(system, threads, arguments):
    """Name and a function that takes one turn."""
    list_ = [(f"springfit {m}", lambda m=m: ours(system, m, threads, arguments)) for m in arguments.methods.split(",")]
    for order in ("own", "given"):
        words = [arguments.out / "cholmod", system.prefix, arguments.repeat, order]
        list_.append((f"cholmod, {order} order", lambda words=words: peer(system, "cholmod", words, threads)))
    for order in ("own", "given"):
        for scheme in ("classic", "two-level"):
            words = [sys.executable, HERE / "pardiso.py", system.prefix, arguments.repeat, order, scheme]
            list_.append((f"pardiso, {order} order, {scheme}", lambda words=words: peer(system, "pardiso", words, threads)))
    return list_


def compare(system, threads, arguments):
    """All turns of all contestants on one size."""
    rows = {}
    for _ in range(arguments.turns):
        for name, turn in contestants(system, threads, arguments):
            found = turn()
            row = rows.setdefault(name, found | {"rounds": [], "processor": [], "load": []})
            row["rounds"] += found["rounds"]
            row["processor"] += found["processor"]
            row["load"].append(os.getloadavg()[0])
            row["residual"] = max(row["residual"], found["residual"])
    for row in rows.values():
        row |= {"size": system.size, "unknowns": len(system.right), "threads": threads}
        row["seconds"] = {"median": statistics.median(row["rounds"]), "least": min(row["rounds"]),
                          "processor": statistics.median(row["processor"])}
    for key in ("median", "least", "processor"):
        better = min(row["seconds"][key] for name, row in rows.items() if not name.startswith("springfit"))
        for row in rows.values():
            row.setdefault("ratio", {})[key] = row["seconds"][key] / better
    return [{"name": name, **row} for name, row in rows.items()]


def table(rows):
    yield (f"{'n':>3} {'thr':>3} {'solver':<32} {'median s':>9} {'ratio':>5} {'least s':>9} {'ratio':>5} {'process.s':>9} {'ratio':>5} "
           f"{'residual':>8} {'backward':>8} {'factor MB':>9} {'Gflop':>8} {'Gflop/s':>7} {'load':>5}")
    for r in rows:
        times = " ".join(f"{r['seconds'][key]:>9.3e} {r['ratio'][key]:>5.2f}" for key in ("median", "least", "processor"))
        backward = f"{r['backward_error']:.1e}" if r["backward_error"] is not None else "-"
        yield (f"{r['size']:>3} {r['threads']:>3} {r['name']:<32} {times} {r['residual']:>8.1e} {backward:>8} "
               f"{r['factor_bytes'] / 1e6:>9.1f} {r['flop'] / 1e9:>8.2f} {r['flop'] / r['seconds']['least'] / 1e9:>7.1f} "
               f"{statistics.mean(r['load']):>5.1f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="9,13,17,25")
    parser.add_argument("--threads", default="1")
    parser.add_argument("--methods", default="direct", help="of springfit bench solve")
    parser.add_argument("--repeat", type=int, default=5, help="timed rounds in a turn")
    parser.add_argument("--turns", type=int, default=3, help="how often ours and theirs alternate")
    parser.add_argument("--springfit", type=Path, default=ROOT / "target/release/springfit")
    parser.add_argument("--out", type=Path, default=Path("peers-out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    subprocess.run(["cc", "-O2", HERE / "cholmod.c", "-I/usr/include/suitesparse", "-lcholmod", "-ldl", "-o",
                    arguments.out / "cholmod"], check=True)
    rows = []
    for size in map(int, arguments.sizes.split(",")):
        run([arguments.springfit, "bench", "solve", "--sizes", size, "--methods", "direct", "--repeat", 1, "--json",
             "--write", arguments.out], 1)
        system = System(arguments.out, size)
        for threads in map(int, arguments.threads.split(",")):
            rows += (new := compare(system, threads, arguments))
            print("\n".join(table(new)), flush=True)
    for kernel in sorted({row["kernel"] for row in rows}):
        print(kernel)
    (arguments.out / "peers.json").write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
