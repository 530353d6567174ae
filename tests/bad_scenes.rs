//! Every file in data/scenes/bad gives its own message: exit status, place and remedy, and no file is written.
//!
//! A file without an expectation fails the test, and so does an expectation without a file.

use std::collections::BTreeSet;
use std::path::Path;

use assert_cmd::Command;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scenes/bad");

/// What a file must answer: its name, the line of the scene that is shown (0: none), words of the message.
type Expectation = (&'static str, usize, [&'static str; 2]);

/// The input is wrong: exit status 2.
const WRONG_INPUT: &[Expectation] = &[
    (
        "acceleration_at_rest",
        16,
        [
            "calibration.acceleration.snapshots: no free node of the continuum is pulled in the state snapshots[0]",
            "give a state that deforms the body",
        ],
    ),
    (
        "adaptive_annealing",
        14,
        ["calibration.optimiser: annealing cannot fit groups that change", "use gauss_newton, or leave"],
    ),
    (
        "adaptive_matrix",
        12,
        ["springs.grouping: \"adaptive\" splits groups by the error of displacements", "or another grouping"],
    ),
    ("adaptive_patience", 13, ["springs.patience: no load is held out", "add a [[load]] with fit = false"]),
    ("alpha_zero", 13, ["dynamics.alpha: 0 is not positive", "give a number above 0"]),
    ("broken_string", 3, ["line 3: not TOML", "strings need quotes"]),
    ("broken_table", 2, ["line 2: not TOML: unclosed table", "a line is KEY = VALUE, [TABLE] or [[load]]"]),
    ("budget_file", 11, ["budget: a body from a file has one resolution", "name a shape that is a patch"]),
    ("budget_finest", 13, ["budget.finest: 3 numbers for a body in 2D", "give 2, one for each direction"]),
    ("budget_zero", 12, ["budget.max_error: 0 is not positive", "give a number above 0"]),
    (
        "control_points_below_degree",
        4,
        [
            "geometry.control_points: [6, 3] control points are too few for this body at degree [2, 3]",
            "at least [3, 4]",
        ],
    ),
    (
        "control_points_dimension",
        4,
        ["geometry.control_points: 3 numbers for a body in 2D", "give 2, one for each direction"],
    ),
    (
        "control_points_few",
        4,
        [
            "geometry.control_points: [8, 5, 5] control points are too few for this body at degree [2, 2, 2]",
            "at least [9, 3, 3]",
        ],
    ),
    (
        "control_points_many",
        4,
        ["geometry.control_points: [100000, 100000] are 10000000000 control points", "at most 100000000"],
    ),
    (
        "control_points_one",
        4,
        ["geometry.control_points[1]: 1 is out of range", "give a whole number from 2 to 100000000"],
    ),
    (
        "degree_of_elements",
        4,
        ["geometry.degree: [2, 2] has no meaning for the method \"q4\"", "remove geometry.degree, or use"],
    ),
    ("converged_box", 11, ["converged: the supports name control points", "hold whole faces (support.faces)"]),
    ("converged_mesh", 13, ["converged: \"q4\" works on a mesh, which is not refined", "use \"iga\" on a patch"]),
    ("converged_not_finer", 11, ["converged: the mesh is not refined", "give halvings or elevations above 0"]),
    ("degree_low", 4, ["geometry.degree: degree [1, 1] is too low for this body", "at least [2, 2]"]),
    ("degree_zero", 4, ["geometry.degree[0]: 0 is out of range", "give a whole number from 1 to 9"]),
    ("duplicate_key", 6, ["line 6: the key is given twice", "keep one of them"]),
    ("dynamics_alpha_twice", 16, ["dynamics.alphas: both alpha and alphas are given", "keep one of the two"]),
    (
        "dynamics_alpha_of_continuum",
        16,
        ["dynamics.model: the continuum has no springs that alpha could damp", "give dynamics.rayleigh"],
    ),
    ("dynamics_free_load", 14, ["dynamics.load_until: no load case acts on a free body", "set dynamics.free to false"]),
    ("dynamics_linear_tolerance", 13, ["dynamics.linear_tolerance: 1e-20 is out of range", "from 1e-14 to 1e-2"]),
    ("dynamics_spin", 13, ["dynamics.angular_velocity: 1 numbers for a body in 3D", "give 3"]),
    (
        "dynamics_tangent",
        13,
        ["dynamics.tangent: only a corotational continuum has a choice of tangents", "set dynamics.model"],
    ),
    ("dynamics_velocity", 13, ["dynamics.velocity: 2 numbers for a body in 3D", "give 3, one for each direction"]),
    (
        "kinematics_of_hexahedra",
        14,
        ["reference.kinematics: \"b8\" is for small displacements", "methods that turn are t3, t4, smoothed_face"],
    ),
    (
        "kinematics_of_patches",
        13,
        ["reference.kinematics: \"iga\" is for small displacements", "or set kinematics = \"linear\""],
    ),
    (
        "large_optimiser",
        16,
        ["calibration.optimiser: annealing solves K(phi) u = f", "use gauss_newton, or the objective acceleration"],
    ),
    ("load_steps_zero", 15, ["reference.load_steps: 0 is out of range", "give a whole number from 1 to 1000"]),
    ("dynamics_rayleigh", 16, ["dynamics.rayleigh[1]: -0.001 is negative", "give a number from 0"]),
    (
        "dynamics_step_text",
        15,
        ["dynamics.step: \"small\" cannot be used here", "expected a number of seconds or \"auto\""],
    ),
    ("dynamics_step_zero", 15, ["dynamics.step: 0 is not positive", "give a number above 0"]),
    ("dynamics_implicit_auto", 16, ["dynamics.step: every step is stable with newmark", "give the step in s"]),
    ("dynamics_steps_and_duration", 16, ["dynamics.steps: both duration and steps are given", "keep one of the two"]),
    ("dynamics_newmark", 15, ["dynamics.newmark: [0, 0.5] is stable for small steps only", "2 beta >= gamma >= 1/2"]),
    ("dynamics_integrator", 15, ["dynamics.integrator: unknown name \"leapfrg\"", "did you mean \"leapfrog\"?"]),
    ("dynamics_load_case", 15, ["dynamics.load_case: unknown name \"wind\"", "known names are load 1"]),
    ("dynamics_load_times", 15, ["dynamics.load_factors[2]: the time 1 does not come after 2", "ascending order"]),
    (
        "dynamics_released_load",
        16,
        ["dynamics.load_until: the body is released from its load", "set dynamics.initial to \"rest\""],
    ),
    ("dynamics_gravity", 15, ["dynamics.gravity: 3 numbers for a body in 2D", "give 2, one for each direction"]),
    ("dynamics_records", 16, ["dynamics.interval: 1000000002 records of 60 numbers", "record less often"]),
    ("dynamics_without_density", 4, ["material.density: is missing", "masses need it: add material.density in kg/m^3"]),
    ("empty", 1, ["material: is missing", "add material"]),
    ("empty_support", 7, ["support: nothing is held", "add support.faces"]),
    (
        "evaluations",
        13,
        ["calibration.annealing.evaluations: 4 is out of range", "give a whole number from 8 to 1000000000"],
    ),
    (
        "file_and_degree",
        4,
        ["geometry.degree: a body from a file has its own", "remove degree; it goes with geometry.shape"],
    ),
    ("gamma_nan", 12, ["calibration.gamma: nan is not a finite number", "give a finite number"]),
    (
        "gamma_one",
        12,
        ["calibration.gamma: 1 is out of range", "give a number above 0 and below 1, or { start = 0.8, step = 0.1 }"],
    ),
    ("gamma_start", 12, ["calibration.gamma.start: gamma starts at 1.5", "a number between 0 and 1, both excluded"]),
    (
        "gamma_text",
        12,
        ["calibration.gamma: \"0.8\" cannot be used here", "expected a number or { start = ..., step = ... }"],
    ),
    (
        "gamma_zero",
        12,
        ["calibration.gamma: 0 is out of range", "give a number above 0 and below 1, or { start = 0.8, step = 0.1 }"],
    ),
    ("edges_node", 12, ["springs.edges[1]: there is no node 36", "the body has 36, numbered from 0 to 35"]),
    ("edge_file_missing", 12, ["no_edges.txt", "cannot be read"]),
    ("list_alone", 12, ["springs.topology: \"list\" has no springs of its own", "add springs.edges"]),
    ("sets_missing", 11, ["springs.sets: the grouping \"sets\" has no sets", "add [[springs.sets]]"]),
    ("spring_set_empty", 13, ["springs.sets[0]: \"corner\" has 1 nodes", "both its ends"]),
    ("spring_set_places", 13, ["springs.sets[0]: several places are given", "keep one of face, set, box, nodes"]),
    ("spring_set_name", 14, ["springs.sets[0].name: \"rest\" is taken", "a name of its own"]),
    ("groups_zero", 12, ["springs.groups: 0 is out of range", "give a whole number from 1 to 1000000"]),
    ("regularisation", 12, ["calibration.regularisation: -1 is negative", "give 0, or an error in percent"]),
    ("regularisation_matrix", 12, ["calibration.regularisation: the objective matrix takes none", "remove it"]),
    ("profile", 12, ["springs.profile: unknown name \"stiffness\"", "known names are constant, axial_rigidity"]),
    ("gauss_points", 12, ["reference.extra_gauss_points: 1000 is out of range", "give a whole number from 0 to 32"]),
    ("infinite", 5, ["material.young: inf is not a finite number", "give a finite number"]),
    ("later_grouping", 12, ["springs.grouping: unknown name \"stress\"", "known names are length"]),
    ("later_key", 10, ["load[0].wind: unknown key", "known keys here are name, fit"]),
    ("later_method", 12, ["reference.method: unknown name \"meshfree\"", "known names are iga, t3, t4, q4, b8"]),
    (
        "load_bending_axes",
        10,
        [
            "load[0].bending.direction: the force would stretch the body, not bend it",
            "give another axis than bending.along",
        ],
    ),
    (
        "load_case_without_file",
        11,
        ["load[0].case: case is given without a file", "it says which forces of load.file are meant"],
    ),
    ("load_file_case", 12, ["load[0].case: the file has no case \"shear\"", "it has bending, point, radial"]),
    (
        "load_file_missing",
        0,
        ["load_file_missing.toml.json: cannot be read", "give the path of a JSON file with forces"],
    ),
    ("load_max_displacement", 11, ["load[0].max_displacement: 0 is not positive", "give a number above 0"]),
    ("load_patch_place", 10, ["load[0].patch: no place is given", "add one of face, set, box"]),
    ("load_radial_zero", 10, ["load[0].radial: 0 is no load", "give a force that is not zero"]),
    (
        "load_torsion_in_plane",
        10,
        ["load[0].torsion.axis: a body in 2D cannot turn about an axis in its plane", "leave it out, or give \"z\""],
    ),
    ("limits_memory", 12, ["limits.memory: \"4 gb\" is no amount of memory", "such as \"4 GB\" or \"512 MiB\""]),
    ("limits_seconds", 12, ["limits.seconds: 0 is not positive", "give a number above 0"]),
    (
        "load_all_held_out",
        10,
        [
            "load[0].fit: every load case is held out: there is nothing to fit to",
            "leave fit out, or set it to true, in at least one [[load]]",
        ],
    ),
    ("load_dimension", 10, ["load[0].force_per_node: 3 numbers for a body in 2D", "give 2, one for each direction"]),
    ("load_missing", 1, ["load: no load case is given", "add a [[load]] table"]),
    (
        "load_name_twice",
        13,
        ["load[1].name: \"a\" is the name of another load case", "give every load case its own name"],
    ),
    ("load_node", 10, ["load[0].point.node: there is no control point 36", "the body has 36, numbered from 0 to 35"]),
    ("load_on_held_face", 9, ["load[0]: acts on no free node", "at least one node that is not held"]),
    ("load_on_held_node", 9, ["load[0]: acts on no free node", "at least one node that is not held"]),
    (
        "load_two_kinds",
        11,
        [
            "load[0].body_force: force_per_node and body_force are given together",
            "one [[load]] table has one kind of load",
        ],
    ),
    (
        "load_without_kind",
        9,
        ["load[0]: no kind of load is given", "add one of force_per_node, traction, body_force, point"],
    ),
    ("load_zero", 10, ["load[0].force_per_node: [0.0, 0.0] is no load", "at least one component that is not zero"]),
    ("mesh_direction", 12, ["springs.grouping: \"direction\" needs nodes on a grid", "use length, kind"]),
    ("mesh_face", 8, ["support.faces: a mesh from a file has no face \"y-\"", "name a set of nodes of the file"]),
    ("mesh_missing", 3, ["nothing_here.msh: No such file", "give a mesh file that can be read"]),
    ("mesh_multigrid", 12, ["multigrid does not fit: the nodes do not lie on a grid", "use auto, direct"]),
    (
        "mesh_set",
        8,
        ["support.sets[0]: there is no set \"floor\"", "the sets of the body are bottom, right, top, left"],
    ),
    (
        "method_of_meshes",
        12,
        ["reference.method: \"q4\" works on meshes, and the file is none", "files of meshes end in .msh, .vtk"],
    ),
    (
        "method_of_other_cells",
        12,
        ["\"t3\" cannot take cell 0 of the mesh, a quadrilateral", "methods for this mesh are q4, q4_bbar"],
    ),
    ("method_of_patches", 12, ["\"iga\" works on patches, and the file holds a mesh", "leave it out, or use \"q4\""]),
    ("method_of_the_plane", 12, ["\"q4\" is not for bodies in 3D", "methods in 3D are iga, t4, b8, b8_bbar"]),
    ("missing_key", 4, ["material.poisson: is missing", "add material.poisson"]),
    ("missing_material", 1, ["material: is missing", "add material"]),
    ("negative_count", 4, ["geometry.control_points[1]: -6 cannot be used here", "expected a whole number from 0"]),
    ("no_body", 2, ["geometry.shape: no body is given", "or geometry.file"]),
    ("no_support", 1, ["support: nothing is held", "add support.faces"]),
    ("not_finite", 10, ["load[0].force_per_node[1]: nan is not a finite number", "give a finite number"]),
    ("not_text", 0, ["line 3: byte 48 is not UTF-8", "save the scene as UTF-8"]),
    (
        "known_missing",
        12,
        [
            "calibration.objective: no stiffness is given",
            "add calibration.stiffness with a number a group, or calibration.springs",
        ],
    ),
    (
        "known_alone",
        12,
        [
            "calibration.stiffness: the objective is displacement, which does not read it",
            "set objective = \"known\", or remove it",
        ],
    ),
    (
        "known_both",
        14,
        ["calibration.springs: gives the stiffness of every spring, and calibration.stiffness", "keep one of them"],
    ),
    (
        "known_text",
        13,
        [
            "calibration.stiffness: \"soft\" cannot be used here",
            "one for each group as [1e3, 500.0], or by their names",
        ],
    ),
    ("known_negative", 13, ["calibration.stiffness[1]: -1 is negative", "0 takes the springs of the group out"]),
    ("known_nothing", 13, ["calibration.stiffness: no spring is left", "give one group a number above 0"]),
    (
        "known_sweep",
        11,
        [
            "calibration.gamma: the groups by length are others at every gamma",
            "give the gamma of the groups, such as gamma = 0.5",
        ],
    ),
    (
        "known_group",
        13,
        [
            "calibration.stiffness.body_diagonal: there is no group \"body_diagonal\"",
            "the groups are edge, face_diagonal",
        ],
    ),
    (
        "known_group_missing",
        13,
        ["calibration.stiffness: the group \"face_diagonal\" has no number", "the groups are edge, face_diagonal"],
    ),
    ("known_count", 13, ["calibration.stiffness: 3 numbers for 2 groups", "the groups are edge, face_diagonal"]),
    (
        "known_optimiser",
        14,
        [
            "calibration.optimiser: hybrid has nothing to do: nothing is fitted with the objective known",
            "leave the optimiser out",
        ],
    ),
    ("known_file_missing", 13, ["springs/nowhere.json: cannot be read", "give the springs.json of a network"]),
    ("known_file_other", 13, ["six_bodies.json: missing field `schema`", "give the springs.json of a network"]),
    (
        "known_file_dimension",
        13,
        ["springs/in_space.json: a network in 3D, and the body is in 2D", "on the control points of this body"],
    ),
    (
        "known_file_node",
        13,
        ["springs/far_node.json: nodes: the body has no control point 36", "on the control points of this body"],
    ),
    ("known_file_place", 13, ["springs/millimetres.json: positions: node 1 is", "in the same unit of length"]),
    (
        "known_file_tension",
        13,
        [
            "springs/tension.json: rest_lengths: spring 0 is 0.3 m long, its nodes are 0.4 m apart",
            "a network under tension at rest is not judged",
        ],
    ),
    ("known_file_stiffness", 13, ["springs/negative.json: k: spring 1 has -2", "give finite numbers from 0, in N/m"]),
    ("known_file_loop", 13, ["calibration.springs[1]: node 1 is joined to itself", "give two different nodes"]),
    (
        "known_budget",
        14,
        ["budget: the network of calibration.springs has one resolution", "or let the network be built from [springs]"],
    ),
    (
        "objective_name",
        12,
        [
            "calibration.objective: unknown name \"velocity\"",
            "known names are displacement, acceleration, matrix, formula, known",
        ],
    ),
    (
        "least_squares_displacement",
        12,
        [
            "calibration.optimiser: least_squares solves linear problems, and displacement is not linear",
            "choose gauss_newton, hybrid or annealing",
        ],
    ),
    (
        "surrogate_matrix",
        13,
        [
            "calibration.optimiser: surrogate works on displacements, and matrix is fitted without any",
            "use least_squares, or leave the optimiser out",
        ],
    ),
    ("matrix_reading", 13, ["calibration.matrix.reading: unknown name \"half\"", "known names are full, off_diagonal"]),
    (
        "formula_missing",
        12,
        [
            "calibration.objective: no formula is given",
            "add calibration.formula, one of lloyd, van_gelder, van_gelder_poisson, van_gelder_volume",
        ],
    ),
    ("formula_name", 13, ["calibration.formula: unknown name \"loyd\"", "did you mean \"lloyd\"?"]),
    (
        "formula_alone",
        12,
        [
            "calibration.formula: the objective is displacement, not a formula",
            "set objective = \"formula\", or remove formula",
        ],
    ),
    (
        "formula_optimiser",
        13,
        [
            "calibration.optimiser: annealing has nothing to do: nothing is fitted with the objective formula",
            "leave the optimiser out",
        ],
    ),
    (
        "formula_poisson",
        6,
        ["material.poisson: lloyd holds for nu = 1/3, not for 0.3", "calibration.objective = \"matrix\""],
    ),
    (
        "formula_strain",
        15,
        ["reference.plane: lloyd holds for plane stress", "use plane stress, or calibration.objective = \"matrix\""],
    ),
    (
        "formula_rectangle",
        14,
        [
            "calibration.formula: lloyd holds for regular cells, and this one is not (cell 0)",
            "\"matrix\" fits any body in one step",
        ],
    ),
    (
        "formula_hexahedra",
        13,
        [
            "calibration.formula: lloyd has no formula for hexahedra (cell 0)",
            "it is for squares, triangles and tetrahedra",
        ],
    ),
    (
        "formula_quadrilaterals",
        13,
        [
            "calibration.formula: van_gelder is for triangles, and this is a quadrilateral (cell 0)",
            "squares at nu = 1/3 have \"lloyd\"",
        ],
    ),
    (
        "formula_hexahedra_van_gelder",
        13,
        [
            "calibration.formula: van_gelder_volume is for tetrahedra, and this is a hexahedron (cell 0)",
            "hexahedra have no formula",
        ],
    ),
    (
        "formula_tetrahedra",
        15,
        [
            "calibration.formula: van_gelder is for triangles, and this is a tetrahedron (cell 0)",
            "tetrahedra have \"van_gelder_volume\"",
        ],
    ),
    (
        "snapshot_empty",
        14,
        ["calibration.acceleration.snapshots[0]: no state is given", "give one of stretch, gradient, loads"],
    ),
    (
        "snapshot_two",
        14,
        [
            "calibration.acceleration.snapshots[0]: stretch and loads are given together",
            "give one of stretch, gradient, loads",
        ],
    ),
    (
        "snapshot_zero",
        14,
        ["calibration.acceleration.snapshots[0].stretch: [0.0, 0.0] moves nothing", "give a number that is not zero"],
    ),
    (
        "snapshot_dimension",
        14,
        ["calibration.acceleration.snapshots[0].stretch: 3 numbers for a body in 2D", "give 2, one for each direction"],
    ),
    (
        "snapshot_row",
        14,
        [
            "calibration.acceleration.snapshots[0].gradient[1]: 1 numbers for a body in 2D",
            "give 2, one for each direction",
        ],
    ),
    (
        "snapshot_large",
        14,
        ["calibration.acceleration.snapshots[0].stretch: 20 is out of range", "0.1 is a strain of 10 %"],
    ),
    (
        "snapshot_history",
        14,
        ["calibration.acceleration.snapshots[0].loads: [] is no load history", "give fractions that are not zero"],
    ),
    ("snapshot_key", 14, ["strech", "did you mean \"stretch\"?"]),
    (
        "snapshot_rests",
        14,
        [
            "calibration.objective: nothing that is compared depends on the stiffness of any group",
            "add a snapshot that stretches the springs",
        ],
    ),
    (
        "snapshot_groups",
        14,
        ["calibration.objective: the equations do not determine", "use fewer groups, more and different snapshots"],
    ),
    ("overflow", 5, ["line 5: the number is too large", "floating-point numbers end near 1.8e308"]),
    ("patch_folder", 3, ["patches: not a regular file", "give a patch file"]),
    ("patch_knots_count", 3, ["patches/knots_count.json: line 4, points: 9 control points", "one for every node"]),
    (
        "patch_knots_decreasing",
        3,
        [
            "patches/knots_decreasing.json: line 3, knots[1][3]: knot 3 is 1, below the one before, 1.5",
            "knots never decrease",
        ],
    ),
    (
        "patch_knots_not_open",
        3,
        [
            "patches/knots_not_open.json: line 3, knots[0][0]: the end knot 0 stands 1 times",
            "knots are open: degree + 1 = 2 times",
        ],
    ),
    ("patch_missing", 3, ["patches/nothing_here.json: No such file", "give a patch file that can be read"]),
    (
        "patch_not_finite",
        3,
        ["patches/not_finite.json: expected value at line 4 column 42", "keys degree, knots, points"],
    ),
    (
        "patch_point_dimension",
        3,
        ["patches/point_dimension.json: line 4, points[8]: point 8 has 3 coordinates", "as many as directions: 2"],
    ),
    ("patch_points_count", 3, ["patches/points_count.json: line 4, points: 8 control points", "one for every node"]),
    ("patch_truncated", 3, ["patches/truncated.json: EOF", "keys degree, knots, points"]),
    ("patch_unknown_key", 3, ["patches/unknown_key.json: unknown field `weight`", "keys degree, knots, points"]),
    (
        "patch_weight_negative",
        3,
        ["patches/weight_negative.json: line 5, weights[4]: weight 4 is -2.5", "weights are positive and finite"],
    ),
    (
        "patch_weight_zero",
        3,
        ["patches/weight_zero.json: line 5, weights[4]: weight 4 is 0", "weights are positive and finite"],
    ),
    ("plane_in_3d", 12, ["reference.plane: the body is in 3D", "remove reference.plane: it is for bodies in 2D"]),
    (
        "poisson_half_3d",
        6,
        ["material.poisson: 0.5 makes the material incompressible", "below 0.5; 0.5 itself only in plane stress"],
    ),
    (
        "poisson_half_strain",
        6,
        ["material.poisson: 0.5 makes the material incompressible", "below 0.5; 0.5 itself only in plane stress"],
    ),
    (
        "poisson_minus_one",
        6,
        ["material.poisson: -1 is out of range", "above -1 and below 0.5; 0.5 itself only in plane stress"],
    ),
    ("shape_and_file", 4, ["geometry.file: both shape and file are given", "keep one of the two"]),
    ("single_load_table", 9, ["load: [load] cannot be used here", "expected [[load]], one table a load case"]),
    ("size_zero", 4, ["geometry.size[1]: 0 is not positive", "give a number above 0"]),
    ("solver_path", 12, ["solver.path: unknown name \"fast\"", "known names are auto, direct, single, stale"]),
    ("solver_tolerance", 12, ["solver.tolerance: 1e-3 is out of range", "give a number from 1e-14 to 1e-6"]),
    ("starts_zero", 12, ["calibration.starts: 0 is out of range", "give a whole number from 1 to 1000"]),
    (
        "step_negative",
        12,
        [
            "calibration.gamma.step: the step is -0.1",
            "a positive number, at least 8e-4 (a sweep has at most 1,000 values)",
        ],
    ),
    (
        "step_tiny",
        12,
        [
            "calibration.gamma.step: the step is 0.000000001",
            "a positive number, at least 8e-4 (a sweep has at most 1,000 values)",
        ],
    ),
    (
        "step_zero",
        12,
        [
            "calibration.gamma.step: the step is 0",
            "a positive number, at least 8e-4 (a sweep has at most 1,000 values)",
        ],
    ),
    (
        "support_box_inverted",
        8,
        ["support.box.max[0]: 0 is below the minimum 1", "give the smaller corner as min and the larger as max"],
    ),
    (
        "support_empty_box",
        7,
        ["support: holds no node", "name a face (x-, x+, y-, ...), a node, a set, or a box that contains some"],
    ),
    ("support_everything", 7, ["support: holds every node", "leave at least one free"]),
    ("support_face", 8, ["support.faces[0]: unknown name \"bottom\"", "known names are x-, x+, y-, y+, z-, z+"]),
    ("support_face_2d", 8, ["support.faces[0]: unknown name \"z-\"", "known names are x-, x+, y-, y+"]),
    ("support_node", 8, ["support.nodes[1]: there is no control point 36", "the body has 36, numbered from 0 to 35"]),
    (
        "temperature",
        12,
        [
            "calibration.annealing.final_temperature: 1 is not below 1: the temperature would not fall",
            "give a number below 1",
        ],
    ),
    ("thickness_zero", 12, ["reference.thickness: 0 is not positive", "give a number above 0"]),
    ("tolerance", 12, ["calibration.gauss_newton.tolerance: 0 is not positive", "give a number above 0"]),
    (
        "traction_box_inside",
        9,
        ["load[0]: 4 nodes are chosen, and no side of the boundary lies between them", "choose all corners"],
    ),
    ("traction_box_on_patch", 9, ["load[0]: no face is given", "a patch takes a traction on a face"]),
    ("traction_two_places", 10, ["load[0].traction: several places are given", "keep one of face, set, box"]),
    ("traction_without_place", 10, ["load[0].traction: no place is given", "add one of face, set, box"]),
    ("unknown_key", 4, ["geometry.control_point: unknown key", "did you mean \"control_points\"?"]),
    ("unknown_shape", 3, ["geometry.shape: unknown name \"cibe\"", "did you mean \"cube\"?"]),
    ("unknown_table", 11, ["spring: unknown key", "did you mean \"springs\"?"]),
    ("weighting", 12, ["springs.weighting: unknown name \"cell\"", "did you mean \"cells\"?"]),
    ("wrong_type", 5, ["material.young: \"15e3\" cannot be used here", "expected a number"]),
    (
        "wrong_type_in_array",
        4,
        ["geometry.control_points[1]: 6.5 cannot be used here", "expected a whole number from 0"],
    ),
    ("young_negative", 5, ["material.young: -15000 is not positive", "give a number above 0"]),
    (
        "cells_and_control_points",
        4,
        [
            "geometry.control_points: the shape \"kuhn_box\" is a mesh and has no control_points",
            "geometry.cells says how fine a mesh is",
        ],
    ),
    (
        "cells_of_a_patch",
        4,
        [
            "geometry.cells: the shape \"cube\" is a patch and has no cells",
            "geometry.control_points says how fine a patch is; meshes are rectangle, box, kuhn_box",
        ],
    ),
    (
        "cells_count",
        4,
        [
            "geometry.cells: cells [4, 2, 2] for the mesh \"ball\"",
            "one whole number from 1 for each of: across the core, shells around it",
        ],
    ),
    (
        "cells_zero",
        4,
        ["geometry.cells: cells [0, 2, 2] for the mesh \"cylinder\"", "one whole number from 1 for each of"],
    ),
    (
        "cells_many",
        4,
        ["geometry.cells: cells [2000, 2000, 2000] make 8012006001 nodes", "at most 1431655764 nodes in all"],
    ),
    (
        "distortion_large",
        4,
        ["geometry.distortion.alpha: 1.5 is out of range", "the share of a cell's width that a node is moved by"],
    ),
    (
        "distortion_of_a_ball",
        4,
        ["geometry.distortion: the mesh \"ball\" cannot be distorted", "remove it; it is for kuhn_box"],
    ),
    ("distortion_key", 4, ["geometry.distortion.alfa: unknown key", "known keys here are alpha, seed"]),
    (
        "method_of_patches_on_a_shape",
        12,
        [
            "reference.method: \"iga\" works on patches, and the shape \"cylinder\" is a mesh",
            "leave it out, or use \"b8\"",
        ],
    ),
    ("support_list_empty", 2, ["support: the list is empty", "add a [[support]] table"]),
    ("support_list_entry", 9, ["support[1]: nothing is held", "add support[1].faces"]),
    (
        "support_list_set",
        10,
        ["support[1].sets[0]: there is no set \"mantle\"", "the sets of the body are x-, x+, y-, y+, side, z-, z+"],
    ),
    ("support_list_key", 10, ["support[1].face: unknown key", "did you mean \"faces\"?"]),
];

/// The numbers do not allow it: exit status 3.
const WRONG_NUMBERS: &[Expectation] = &[
    ("loose_fit", 13, ["the fitted network is a mechanism with", "add snapshots that deform the body in other ways"]),
    ("cell_folded", 2, ["element [0] is folded", "or the nodes of the mesh"]),
    ("dynamics_unstable", 16, ["the step of 1e0 s is unstable with leapfrog", "no damping makes this step stable"]),
    (
        "dynamics_unstable_damping",
        16,
        ["the step of 1e-2 s is unstable with leapfrog: with the largest eigenfrequency", "give alpha = "],
    ),
    ("mechanism", 12, ["the spring network is a mechanism with 5 zero modes: node", "use a topology with diagonals"]),
    ("over_memory", 13, ["the run needs about 2.6 GB of memory (512000 nodes", "limits.memory allows 1.0 GB"]),
    ("over_seconds", 12, ["s, and limits.seconds allows 0.000001 s", "raise limits.seconds"]),
    ("patch_folded", 2, ["element [2, 1] is folded", "move the control points"]),
    (
        "support_one_node",
        7,
        ["the reference body is a mechanism with 1 zero mode: it can turn about z", "support.fix_rigid = true"],
    ),
];

#[test]
fn every_bad_scene_has_an_expectation() {
    let files: BTreeSet<String> = std::fs::read_dir(FOLDER)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    let expected = WRONG_INPUT.iter().chain(WRONG_NUMBERS).map(|(name, ..)| (*name).to_owned());
    assert_eq!(files, expected.collect());
}

#[test]
fn wrong_input_names_file_line_key_and_remedy() {
    WRONG_INPUT.iter().for_each(|expectation| answers(expectation, 2));
}

#[test]
fn wrong_numbers_name_the_place_and_the_remedy() {
    WRONG_NUMBERS.iter().for_each(|expectation| answers(expectation, 3));
}

#[test]
fn a_scene_that_is_not_there_is_named() {
    for path in ["no/such.toml", env!("CARGO_MANIFEST_DIR")] {
        let output = springfit().args(["run", path]).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(path) && message.contains("give the path of a scene"), "{message}");
    }
}

fn springfit() -> Command {
    Command::cargo_bin("springfit").unwrap()
}

/// Runs a scene of the folder and compares its answer.
fn answers((name, line, words): &Expectation, status: i32) {
    let out = tempfile::tempdir().unwrap();
    let results = out.path().join("results");
    let file = format!("{name}.toml");
    let output = springfit().current_dir(FOLDER).args(["run", &file, "--out"]).arg(&results).output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(status), "{name}: {message}");
    assert_eq!(output.stdout, b"", "{name}");
    assert!(!Path::exists(&results), "{name} wrote files");
    let place = if *line == 0 { file } else { format!("[{file}:{line}:") };
    for words in words.iter().copied().chain([place.as_str()]) {
        assert!(message.contains(words), "{name}: no {words:?} in {message}");
    }
}
