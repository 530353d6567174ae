"""MKL PARDISO on one system: analyse once, then factor and solve in rounds.

    pardiso.py PREFIX ROUNDS own|given classic|two-level

reads PREFIX.npz (written by compare.py from PREFIX.mtx) and, for "given", PREFIX_order.txt; writes the last solution
(doubles) to PREFIX_pardiso.x; prints one JSON object. The first round is a warm-up and is not printed.
"""

import ctypes
import glob
import json
import os
import sys
import time

import numpy as np


def library():
    """libmkl_rt of the Python package mkl, or of the system."""
    found = sorted(glob.glob(os.path.join(sys.prefix, "lib", "libmkl_rt.so*")))
    return ctypes.CDLL(found[-1] if found else "libmkl_rt.so", mode=ctypes.RTLD_GLOBAL)


def main(prefix, rounds, ordering, scheme):
    mkl = library()
    data = np.load(prefix + ".npz")
    # the lower triangle by columns is the upper triangle by rows, as PARDISO wants it
    starts, columns = data["indptr"].astype(np.int32), data["indices"].astype(np.int32)
    values, right = data["data"], data["right"]
    n = len(starts) - 1
    solution = np.zeros(n)
    handle = np.zeros(64, dtype=np.int64)
    parameters = np.zeros(64, dtype=np.int32)
    parameters[0] = 1
    parameters[1] = 2  # METIS
    parameters[7] = 0  # no refinement
    parameters[17] = -1  # report the entries of the factor
    parameters[18] = -1  # and the Mflop of a factorisation
    parameters[23] = 1 if scheme == "two-level" else 0
    parameters[34] = 1  # indices from 0
    order = np.zeros(n, dtype=np.int32)
    if ordering == "given":
        parameters[4] = 1
        order[:] = np.loadtxt(prefix + "_order.txt", dtype=np.int32)

    def call(phase):
        i = lambda value: ctypes.byref(ctypes.c_int(value))
        p = lambda array: array.ctypes.data_as(ctypes.c_void_p)
        error = ctypes.c_int(0)
        start = time.perf_counter()
        mkl.pardiso(p(handle), i(1), i(1), i(2), i(phase), i(n), p(values), p(starts), p(columns), p(order), i(1),
                    p(parameters), i(0), p(right), p(solution), ctypes.byref(error))
        seconds = time.perf_counter() - start
        if error.value:
            raise SystemExit(f"PARDISO phase {phase} failed with {error.value}")
        return seconds

    analyse = call(11)
    times, processor = [], []
    for _ in range(rounds + 1):
        before = time.process_time()
        times.append((call(22), call(33)))
        processor.append(time.process_time() - before)
    times, processor = times[1:], processor[1:]
    solution.tofile(prefix + "_pardiso.x")
    version = ctypes.create_string_buffer(198)
    mkl.mkl_get_version_string(version, 198)
    print(json.dumps({
        "analyse": analyse,
        "refactor": [pair[0] for pair in times],
        "solve": [pair[1] for pair in times],
        "processor": processor,
        "factor_bytes": int(parameters[17]) * 8,
        "flop": float(parameters[18]) * 1e6,
        "kernel": version.value.decode().strip(),
    }))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4])
