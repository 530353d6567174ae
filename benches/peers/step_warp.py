"""Leapfrog of one network in NVIDIA Warp on the processor (one thread: Warp has no more there).

    step_warp.py PREFIX ROUNDS f32|f64 springs|nodes

"springs": one task a spring, which adds to both ends; "nodes": one task a node, which reads its springs. Prints one JSON
object.
"""

import json
import sys

import numpy as np
import warp as wp

from step_network import Network, measure

prefix, rounds, precision, way = sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4]
real, vector = (wp.float32, wp.vec3f) if precision == "f32" else (wp.float64, wp.vec3d)
network = Network(prefix, np.float32 if precision == "f32" else np.float64)
DAMPED = wp.constant(network.damped)

wp.config.quiet = True
wp.config.verify_fp = False


@wp.func
def pull(d: vector, w: vector, k: real, l0: real, c: real):
    length = wp.length(d)
    n = d / length
    if wp.static(network.damped):
        return (k * (length - l0) + c * wp.dot(w, n)) * n
    return (k * (length - l0)) * n


@wp.kernel
def along_springs(x: wp.array(dtype=vector), v: wp.array(dtype=vector), ends: wp.array2d(dtype=wp.int32),
                  k: wp.array(dtype=real), l0: wp.array(dtype=real), c: wp.array(dtype=real), f: wp.array(dtype=vector)):
    s = wp.tid()
    a = ends[s, 0]
    b = ends[s, 1]
    force = pull(x[b] - x[a], v[b] - v[a], k[s], l0[s], c[s])
    wp.atomic_add(f, a, force)
    wp.atomic_sub(f, b, force)


@wp.kernel
def around_nodes(x: wp.array(dtype=vector), v: wp.array(dtype=vector), starts: wp.array(dtype=wp.int32),
                 others: wp.array(dtype=wp.int32), springs: wp.array(dtype=wp.int32), k: wp.array(dtype=real),
                 l0: wp.array(dtype=real), c: wp.array(dtype=real), f: wp.array(dtype=vector)):
    a = wp.tid()
    total = vector()
    for entry in range(starts[a], starts[a + 1]):
        b = others[entry]
        s = springs[entry]
        total += pull(x[b] - x[a], v[b] - v[a], k[s], l0[s], c[s])
    f[a] = total


@wp.kernel
def move(x: wp.array(dtype=vector), v: wp.array(dtype=vector), f: wp.array(dtype=vector), mobility: wp.array(dtype=real),
         g: vector, h: real):
    node = wp.tid()
    m = mobility[node]
    if m > real(0.0):
        new = v[node] + h * (f[node] * m + g)
        v[node] = new
        x[node] = x[node] + h * new


wp.init()
put = lambda values, kind: wp.array(values, dtype=kind, device="cpu")
x, v = put(network.positions, vector), put(network.velocities, vector)
f = wp.zeros(len(network.positions), dtype=vector, device="cpu")
k, l0, c, mobility = (put(a, real) for a in (network.stiffness, network.length, network.damping, network.mobility))
ends = wp.array(network.ends, dtype=wp.int32, device="cpu")
starts, others, springs = (put(a, wp.int32) for a in network.by_node())
g, h = vector(*network.gravity), real(network.step)


def advance():
    if way == "springs":
        f.zero_()
        wp.launch(along_springs, dim=len(network.ends), inputs=[x, v, ends, k, l0, c, f], device="cpu")
    else:
        inputs = [x, v, starts, others, springs, k, l0, c, f]
        wp.launch(around_nodes, dim=len(network.positions), inputs=inputs, device="cpu")
    wp.launch(move, dim=len(network.positions), inputs=[x, v, f, mobility, g, h], device="cpu")


found = measure(network, advance, lambda: wp.synchronize_device("cpu"), lambda: x.numpy().astype(np.float64), rounds)
print(json.dumps({"version": f"warp {wp.__version__}", **found}))
