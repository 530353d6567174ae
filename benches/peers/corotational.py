"""A step of the corotational beam in springfit and in Genesis, on the same tetrahedra; see README.md for what differs."""

import argparse
import itertools
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
SIZE, YOUNG, POISSON, DENSITY, GRAVITY, STEP = (1.0, 0.2, 0.2), 1e6, 0.3, 1000.0, 9.81, 0.01
MU = YOUNG / (2 * (1 + POISSON))
LAMBDA = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))


def kuhn_box(cells):
    """Nodes, x fastest, and tetrahedra of positive volume: the mesh of `shape = "kuhn_box"`."""
    n = [count + 1 for count in cells]
    nodes = np.array([[SIZE[0] * i / cells[0], SIZE[1] * j / cells[1], SIZE[2] * k / cells[2]]
                      for k in range(n[2]) for j in range(n[1]) for i in range(n[0])])
    stride = (1, n[0], n[0] * n[1])
    tetrahedra = []
    for k, j, i in itertools.product(*(range(count) for count in reversed(cells))):
        corner = i + j * stride[1] + k * stride[2]
        for path in itertools.permutations(range(3)):
            corners = [corner]
            for axis in path:
                corners.append(corners[-1] + stride[axis])
            if path in ((0, 2, 1), (1, 0, 2), (2, 1, 0)):
                corners[2], corners[3] = corners[3], corners[2]
            tetrahedra.append(corners)
    return nodes, np.array(tetrahedra)


def bent(nodes):
    """The beam bent to a quarter of a circle: the state in which a step is measured."""
    radius = 2 / np.pi
    x, y, z = nodes.T
    return np.stack([(radius - z) * np.sin(x / radius), y, radius - (radius - z) * np.cos(x / radius)], axis=1)


def geometry(nodes, tetrahedra, places):
    """Gradients of the four shape functions, volumes, and rotations of the tetrahedra where the nodes are."""
    edges = (nodes[tetrahedra[:, 1:]] - nodes[tetrahedra[:, :1]]).transpose(0, 2, 1)
    volumes, gradients = np.linalg.det(edges) / 6, np.linalg.inv(edges)
    gradients = np.concatenate([-gradients.sum(axis=1, keepdims=True), gradients], axis=1)
    u, _, v = np.linalg.svd(np.einsum("eai,eaj->eij", places[tetrahedra], gradients))
    u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]
    return gradients, volumes, u @ v


def force(nodes, tetrahedra, places):
    """Corotational forces, and lumped masses."""
    gradients, volumes, rotation = geometry(nodes, tetrahedra, places)
    deformation = np.einsum("eai,eaj->eij", places[tetrahedra], gradients)
    strain = rotation.transpose(0, 2, 1) @ deformation - np.eye(3)
    strain = (strain + strain.transpose(0, 2, 1)) / 2
    trace = np.trace(strain, axis1=1, axis2=2)[:, None, None]
    stress = rotation @ (2 * MU * strain + LAMBDA * trace * np.eye(3))
    out, masses = np.zeros_like(nodes), np.zeros(len(nodes))
    np.add.at(out, tetrahedra, -np.einsum("e,eij,eaj->eai", volumes, stress, gradients))
    np.add.at(masses, tetrahedra, np.repeat(DENSITY * volumes[:, None] / 4, 4, axis=1))
    return out, masses


def direct_step(nodes, tetrahedra, free):
    """The displacement of one semi-implicit step from the bent state at rest, (M / h^2 + K) dx = f + M g, by a direct solve."""
    import scipy.sparse as sparse
    from scipy.sparse.linalg import spsolve

    gradients, volumes, rotation = geometry(nodes, tetrahedra, bent(nodes))
    turned = np.einsum("eij,eaj->eai", rotation, gradients)
    blocks = LAMBDA * np.einsum("eai,ebj->eabij", turned, turned) + MU * np.einsum("ebi,eaj->eabij", turned, turned)
    blocks += MU * np.einsum("eai,ebi->eab", turned, turned)[..., None, None] * np.eye(3)
    blocks *= volumes[:, None, None, None, None]
    dofs = 3 * tetrahedra[:, :, None] + np.arange(3)
    rows = np.broadcast_to(dofs[:, :, None, :, None], blocks.shape)
    columns = np.broadcast_to(dofs[:, None, :, None, :], blocks.shape)
    n = 3 * len(nodes)
    stiffness = sparse.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), (n, n)).tocsr()
    right, masses = force(nodes, tetrahedra, bent(nodes))
    right[:, 2] -= masses * GRAVITY
    matrix = (stiffness + sparse.diags(np.repeat(masses, 3) / STEP**2))[free][:, free]
    moved = np.zeros(n)
    moved[free] = spsolve(matrix.tocsc(), right.ravel()[free])
    return moved.reshape(-1, 3), np.linalg.norm(right.ravel()[free])


def genesis_turn(cells, repeat, threads):
    """Steps of Genesis from the bent state at rest, each with one linear solve; runs in a process of its own."""
    os.sched_setaffinity(0, list(os.sched_getaffinity(0))[:threads])
    for name in ("QD_CPU_MAX_NUM_THREADS", "TI_CPU_MAX_NUM_THREADS"):
        os.environ[name] = str(threads)
    import genesis as gs
    import genesis.utils.element as element

    nodes, tetrahedra = kuhn_box(cells)
    held = np.flatnonzero(nodes[:, 0] == 0.0)
    free = np.repeat(nodes[:, 0] > 0.0, 3).nonzero()[0]
    exact, right = direct_step(nodes, tetrahedra, free)
    gs.init(backend=gs.cpu, precision="64", logging_level="error")
    scene = gs.Scene(
        sim_options=gs.options.SimOptions(dt=STEP, substeps=1, gravity=(0.0, 0.0, -GRAVITY)),
        # its threshold is on the square of the residual in N
        fem_options=gs.options.FEMOptions(
            use_implicit_solver=True, n_newton_iterations=1, n_pcg_iterations=1, pcg_threshold=(1e-6 * right) ** 2,
            n_linesearch_iterations=0, damping_alpha=0.0, damping_beta=0.0, enable_vertex_constraints=True,
            floor_height=-100.0),
        show_viewer=False)
    # its own tetrahedra of the box are replaced by ours
    element.mesh_to_elements = lambda *_, **__: (nodes.copy(), tetrahedra.copy())
    element.split_all_surface_tets = lambda verts, elems: (verts, elems)
    beam = scene.add_entity(
        morph=gs.morphs.Box(size=SIZE, pos=tuple(extent / 2 for extent in SIZE)),
        material=gs.materials.FEM.Elastic(E=YOUNG, nu=POISSON, rho=DENSITY, model="linear_corotated"))
    scene.build()
    assert beam.n_vertices == len(nodes) and beam.n_elements == len(tetrahedra)
    start = bent(nodes)
    beam.set_vertex_constraints(held, start[held])
    solver, least = scene.sim.fem_solver, {"iterations": 0}

    def counted():
        """As many iterations as the threshold asks for; it would go on to its given number without doing anything."""
        solver.init_pcg_solve()
        least["iterations"] = 0
        while solver.batch_pcg_active.to_numpy().any():
            solver.one_pcg_iter()
            least["iterations"] += 1

    def step():
        beam.set_position(start)
        beam.set_velocity(np.zeros_like(start))
        before = time.perf_counter(), time.process_time()
        scene.step()
        return time.perf_counter() - before[0], time.process_time() - before[1]

    original, solver.pcg_solve = solver.pcg_solve, counted
    step()
    solver.pcg_solve, solver._n_pcg_iterations = original, least["iterations"]
    step()
    rounds = [step() for _ in range(repeat)]
    state = beam.get_state().pos
    reached = np.asarray(state.cpu() if hasattr(state, "cpu") else state).reshape(-1, 3)
    error = np.abs(reached - start - exact).max() / np.abs(exact).max()
    return {"rounds": [one[0] for one in rounds], "processor": [one[1] for one in rounds], "error": error,
            "iterations": least["iterations"], "version": f"genesis {gs.__version__}"}


def ours(sizes, threads, arguments):
    words = [arguments.springfit, "bench", "corotational", "--sizes", ",".join(map(str, sizes)), "--threads", str(threads), "--json"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)["rows"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="20,40", help="cells along the beam, multiples of 5")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeat", type=int, default=10)
    parser.add_argument("--springfit", default=ROOT / "target/release/springfit")
    parser.add_argument("--turn", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.turn:
        cells = (arguments.turn, arguments.turn // 5, arguments.turn // 5)
        print("\n" + json.dumps(genesis_turn(cells, arguments.repeat, arguments.threads)))
        return
    sizes = [int(size) for size in arguments.sizes.split(",")]
    rows = ours(sizes, arguments.threads, arguments)
    print(f"load {os.getloadavg()[0]:.1f}; milliseconds of one step, least processor time (median on the wall)")
    print(f"{'cells':<9}{'program':<44}{'processor':>10}{'wall':>10}{'iterations':>12}{'error':>10}")
    for size in sizes:
        name = f"{size}x{size // 5}x{size // 5}"
        for row in (row for row in rows if row["cells"][0] == size and row["method"] in ("t4", "smoothed_face")):
            cost = row["cost"]
            for solve, kind in (("iterative", "CG"), ("direct", "Cholesky")):
                whole = 1e3 * (cost["force"] + cost["assembly"] + cost[solve])
                iterations = cost["iterations"] if kind == "CG" else ""
                program = f"springfit {row['method']}, {kind}"
                print(f"{name:<9}{program:<44}{whole:>10.2f}{'':>10}{iterations:>12}")
        words = [sys.executable, __file__, "--turn", size, "--repeat", arguments.repeat, "--threads", arguments.threads]
        done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(done.stderr[-2000:])
        found = json.loads(done.stdout[done.stdout.rindex("\n{"):])
        print(f"{name:<9}{found['version'] + ' linear_corotated, PCG':<44}{1e3 * min(found['processor']):>10.2f}"
              f"{1e3 * statistics.median(found['rounds']):>10.2f}{found['iterations']:>12}{found['error']:>10.1e}")


if __name__ == "__main__":
    main()
