//! Supports and loads: free bodies, everything held, nothing loaded, forces on held nodes.

use springfit::error::Error;
use springfit::study::{Study, body};

use super::common::{CUBE, SQUARE, parse, refused, run, runs, says, warned};

#[test]
fn rigid_body() {
    // nothing held: an error with the number of modes and the way out
    for text in [SQUARE.replace("faces = [\"y-\"]\n", ""), CUBE.replace("faces = [\"z-\"]\n", "")] {
        let words = ["nothing is held", "3 zero modes in 2D and 6 in 3D", "support.fix_rigid = true"];
        says(&refused(&text), 2, &words);
    }
    // one corner held: one turn in the plane, three in space, named
    let corner = SQUARE.replace("faces = [\"y-\"]", "nodes = [0]");
    let words = ["reference body", "1 zero mode:", "it can turn about z through (0, 0) m", "fix_rigid"];
    says(&refused(&corner), 3, &words);
    let corner = CUBE.replace("faces = [\"z-\"]", "nodes = [0]");
    let error = refused(&corner);
    assert!(matches!(&error, Error::Mechanism { modes: 3, motions, .. } if motions.len() == 3), "{error:?}");
    // the point of the axis that is nearest to the middle
    for (axis, point) in [("x", "1, 0, 0"), ("y", "0, 1, 0"), ("z", "0, 0, 1")] {
        says(&error, 3, &[&format!("it can turn about {axis} through ({point}) m")]);
    }
    // held in one direction only: what is left slides
    let across = CUBE.replace("faces = [\"z-\"]", "faces = [\"z-\"]\ncomponents = [\"z\"]");
    says(&refused(&across), 3, &["3 zero modes", "it can slide along x", "it can slide along y", "turn about z"]);
    // the option: as many components as there are motions, named, and the body runs
    for (text, count) in [
        (SQUARE.replace("faces = [\"y-\"]", "fix_rigid = true"), 3),
        (CUBE.replace("faces = [\"z-\"]", "fix_rigid = true"), 6),
        (CUBE.replace("faces = [\"z-\"]", "nodes = [0]\nfix_rigid = true"), 3),
        (CUBE.replace("faces = [\"z-\"]", "faces = [\"z-\"]\nfix_rigid = true"), 0),
    ] {
        let built = body::build(&parse(&text).expect("a scene")).expect("a body that is held");
        let words: Vec<&String> = built.warnings.iter().filter(|word| word.contains("fix_rigid")).collect();
        assert_eq!(words.iter().map(|word| word.matches(" of node ").count()).sum::<usize>(), count, "{words:?}");
        runs(&text);
    }
}

#[test]
fn all_nodes_fixed_or_no_load() {
    let all = SQUARE.replace("faces = [\"y-\"]", "box = { min = [-9.0, -9.0], max = [9.0, 9.0] }");
    says(&refused(&all), 2, &["support", "holds every node"]);
    let none = SQUARE.replace("force_per_node = [2.0, -1.0]", "force_per_node = [0.0, 0.0]");
    says(&refused(&none), 2, &["load[0]"]);
    let held = SQUARE.replace("force_per_node = [2.0, -1.0]", "point = { node = 0, force = [1.0, 1.0] }");
    says(&refused(&held), 2, &["load[0]", "acts on no free node"]);
}

#[test]
fn force_on_a_fixed_node() {
    // y is held along the face, x of one node by fix_rigid: a force on a node of the face has a part that is held
    let text = SQUARE
        .replace("faces = [\"y-\"]", "faces = [\"y-\"]\ncomponents = [\"y\"]\nfix_rigid = true")
        .replace("force_per_node = [2.0, -1.0]", "point = { node = 12, force = [3.0, -7.0] }");
    let study = runs(&text);
    warned(&study.warnings, &["load[0]", "node 12", "-7.0", "part of its reaction"]);
    let load = &study.loads[0].load;
    assert_eq!((load.total, load.held), ([3.0, 0.0, 0.0], [0.0, -7.0, 0.0]));
    assert_eq!(load.reaction(), [-3.0, 7.0, 0.0]);
    // the forces of the continuum at its held nodes balance what acts on the free ones
    let points = study.body.integration_points().expect("points");
    let moved = study.body.dofs.expand(&study.reference.cases[0].displacement);
    let forces = springfit::reference::stiffness::internal_forces(&points, study.body.lame, &moved).expect("forces");
    let mut support = [0.0; 3];
    for (node, force) in forces.iter().enumerate() {
        for (a, &dof) in study.body.dofs.free(node).iter().enumerate() {
            if dof == springfit::geometry::dofs::FIXED {
                support[a] += force[a];
            }
        }
    }
    // the support also takes the held part of the load
    let reaction = [0, 1].map(|a| support[a] - load.held[a]);
    assert!((reaction[0] + 3.0).abs() < 1e-9 && (reaction[1] - 7.0).abs() < 1e-9, "{reaction:?}");
    // no word where nothing is held of the load
    let plain = run(SQUARE).expect("it runs");
    assert!(!plain.warnings.iter().any(|warning| warning.contains("reaction")), "{:?}", plain.warnings);
}

/// Forces of a file on a support that is loaded at two of its nodes.
fn held_forces(pair: [[f64; 2]; 2]) -> Study {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("forces.json");
    let mut forces = vec![[2.0, -1.0]; 16];
    [0, 4, 8, 12].iter().for_each(|&node| forces[node] = [0.0; 2]);
    [forces[4], forces[8]] = pair;
    std::fs::write(&path, format!("{forces:?}")).expect("a file");
    let load = format!("file = {:?}", path.to_str().expect("UTF-8"));
    runs(&SQUARE.replace("force_per_node = [2.0, -1.0]", &load))
}

#[test]
fn forces_that_a_support_takes_are_told_by_their_size_and_not_by_their_sum() {
    let balanced = held_forces([[0.0, 5.0], [0.0, -5.0]]);
    assert_eq!(balanced.loads[0].load.held, [0.0; 3]);
    warned(&balanced.warnings, &["held components of node 4 and 1 more", "up to 5.0 N at a node"]);
    for none in [[[0.0; 2]; 2], [[-0.0; 2]; 2], [[1e-16, 0.0], [0.0, -3e-15]]] {
        let study = held_forces(none);
        assert!(!study.warnings.iter().any(|word| word.contains("support")), "{none:?}: {:?}", study.warnings);
    }
}
