//! The springs against the counts of the source, the pinned numbers of `reference/objects.json`, and their algebra.

use serde_json::Value;
use springfit::geometry::dofs::{DofMap, FIXED, tie_coincident};
use springfit::geometry::grid::Grid;
use springfit::sparse::cholesky::{Factor, Symbolic};
use springfit::sparse::ordering;
use springfit::springs::affine::{self, AffineStiffness};
use springfit::springs::grouping::{self, Grouping, NodeSet, Request};
use springfit::springs::network::{Kind, Network, Spring};
use springfit::springs::weighting::{self, Weighting};
use springfit::springs::{bounds, damping, profiles, topology};

/// A control net with its supports.
struct Body {
    grid: Grid,
    points: Vec<[f64; 3]>,
    dofs: DofMap,
}

impl Body {
    /// Holds the first layer of a grid direction.
    fn held(shape: &[usize], points: Vec<[f64; 3]>, direction: usize, merge: bool) -> Self {
        let grid = Grid::new(shape);
        let fixed: Vec<[bool; 3]> = (0..grid.len()).map(|node| [grid.index(node)[direction] == 0; 3]).collect();
        let master = if merge { tie_coincident(&points, 1e-12) } else { (0..grid.len() as u32).collect() };
        Self { dofs: DofMap::new(grid.dimension(), master, &fixed), grid, points }
    }

    fn network(&self) -> Network {
        (topology::find("grid").expect("in the table").connect)(&self.grid, &self.points, &self.dofs)
    }
}

fn box_body(shape: &[usize], size: &[f64]) -> Body {
    let grid = Grid::new(shape);
    let points = (0..grid.len()).map(|node| {
        let index = grid.index(node);
        let mut x = [0.0; 3];
        for a in 0..shape.len() {
            x[a] = size[a] * index[a] as f64 / (shape[a] - 1) as f64;
        }
        x
    });
    Body::held(shape, points.collect(), shape.len() - 1, false)
}

/// Inserts knots into a quadratic curve of one span on [0, 1] in homogeneous coordinates (w x, w y, w z, w).
fn insert(mut points: Vec<[f64; 4]>, new: &[f64]) -> Vec<[f64; 4]> {
    let mut knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    for &u in new {
        let span = knots.partition_point(|&k| k <= u) - 1;
        let refined = (0..=points.len()).map(|i| {
            let alpha = match i {
                i if i + 2 <= span => 1.0,
                i if i <= span => (u - knots[i]) / (knots[i + 2] - knots[i]),
                _ => 0.0,
            };
            let (here, before) = (points[i.min(points.len() - 1)], points[i.saturating_sub(1)]);
            std::array::from_fn(|c| alpha * here[c] + (1.0 - alpha) * before[c])
        });
        points = refined.collect();
        knots.insert(span + 1, u);
    }
    points
}

/// The disc of section 8, radius 1, knots inserted in both directions; homogeneous, C order.
fn disc(new: &[f64]) -> Vec<[f64; 4]> {
    let s = 0.5_f64.sqrt();
    let h = |x: f64, y: f64, w: f64| [w * x, w * y, 0.0, w];
    let rows = [
        [h(-s, -s, 1.0), h(-2.0 * s, 0.0, s), h(-s, s, 1.0)],
        [h(0.0, -2.0 * s, s), h(0.0, 0.0, 1.0), h(0.0, 2.0 * s, s)],
        [h(s, -s, 1.0), h(2.0 * s, 0.0, s), h(s, s, 1.0)],
    ];
    let rows: Vec<Vec<[f64; 4]>> = rows.iter().map(|row| insert(row.to_vec(), new)).collect();
    let n = new.len() + 3;
    let columns: Vec<Vec<[f64; 4]>> = (0..n).map(|j| insert(rows.iter().map(|row| row[j]).collect(), new)).collect();
    (0..n * n).map(|node| columns[node % n][node / n]).collect()
}

fn circle() -> Body {
    let points = disc(&[0.25, 0.5, 0.75]).iter().map(|h| [h[0] / h[3], h[1] / h[3], 0.0]).collect();
    Body::held(&[6, 6], points, 1, false)
}

fn torus(merge: bool) -> Body {
    let (cross, around) = (0.375, 0.875);
    let sweep = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)];
    let section: Vec<[f64; 3]> = disc(&[1.0 / 3.0, 2.0 / 3.0])
        .iter()
        .map(|h| [around + cross * h[0] / h[3], cross * h[1] / h[3], 0.0])
        .collect();
    let ring = |(c, s): (i32, i32)| {
        section.iter().map(move |x| [x[0] * f64::from(c), x[0] * f64::from(s), x[1]]).collect::<Vec<_>>()
    };
    let points = sweep.iter().flat_map(|&corner| ring(corner)).collect();
    Body::held(&[9, 5, 5], points, 1, merge)
}

fn objects() -> Value {
    serde_json::from_str(include_str!("reference/objects.json")).expect("the reference file is JSON")
}

fn body(name: &str) -> Body {
    match name {
        "square" => box_body(&[6, 6], &[2.0, 2.0]),
        "circle" => circle(),
        "cube" => box_body(&[6, 6, 6], &[2.0, 2.0, 2.0]),
        "torus" => torus(false),
        _ => panic!("no body {name}"),
    }
}

/// p_s of every spring.
fn factors(profile: &str, network: &Network) -> Vec<f64> {
    (profiles::find(profile).expect("in the table").factor)(network, &[])
}

fn group(name: &str, network: &Network, gamma: f64) -> Grouping {
    let half = NodeSet { name: "half".into(), nodes: (0..network.positions.len() as u32 / 2).collect() };
    let request = Request { sets: &[half], ..Request::with_gamma(gamma) };
    (grouping::find(name).expect("in the table").group)(network, &request).expect("a good gamma")
}

fn assert_near(found: f64, expected: f64, relative: f64, what: &str) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{what}: {found} instead of {expected}");
}

/// Numbers between 0 and 1 that look random and are the same for ever.
fn scattered(i: usize) -> f64 {
    ((12.9898 * (i as f64 + 1.0)).sin() * 43758.5453).rem_euclid(1.0)
}

#[test]
fn method_section_2_spring_counts() {
    let count = |body: Body| body.network().springs.len();
    let flat = |n| count(box_body(&[n, n], &[2.0, 2.0]));
    assert_eq!([flat(6), flat(9), flat(5)], [110, 272, 72]);
    let solid = |shape: [usize; 3]| count(box_body(&shape, &[2.0, 2.0, 0.4]));
    assert_eq!([solid([6, 6, 6]), solid([7, 7, 7]), solid([7, 7, 2])], [1940, 3258, 673]);
    assert_eq!(solid([9, 10, 3]), 2315, "the spheroid's grid");
    assert_eq!(count(torus(false)), 2000);
}

#[test]
fn objects_json_lengths() {
    for (name, object) in objects()["objects"].as_object().expect("a table") {
        let network = body(name).network();
        let lengths: Vec<f64> = network.springs.iter().map(|spring| spring.length).collect();
        let expected = |key: &str| object["reference"][key].as_f64().expect("a number");
        assert_eq!(lengths.len() as f64, expected("springs"));
        assert_near(lengths.iter().sum(), expected("sum_rest_lengths"), 1e-12, name);
        assert_near(lengths.iter().copied().fold(f64::MAX, f64::min), expected("min_length"), 1e-12, name);
        assert_near(lengths.iter().copied().fold(0.0, f64::max), expected("max_length"), 1e-12, name);
        assert_eq!(network.zero_length, 0);
    }
}

#[test]
fn objects_json_groups_and_bounds() {
    for (name, object) in objects()["objects"].as_object().expect("a table") {
        let body = body(name);
        let network = body.network();
        let measures = bounds::node_measures(&body.grid, &body.points, &body.dofs, 1.0);
        let limits = bounds::spring_bounds(&network, &measures, 15e3, 1.0 / 3.0);
        for row in object["by_gamma"].as_array().expect("rows") {
            let gamma = row["gamma"].as_f64().expect("a number");
            let grouping = group("length", &network, gamma);
            let upper = bounds::upper_bounds(&grouping, &limits, &factors("constant", &network));
            assert_eq!(grouping.groups.len() as u64, row["m"].as_u64().expect("a number"), "{name} {gamma}");
            for (a, found) in grouping.groups.iter().enumerate() {
                let what = format!("{name}, gamma {gamma}, group {a}");
                assert_near(found.length, row["reps"][a].as_f64().expect("a number"), 1e-12, &what);
                assert_near(upper[a], row["ub"][a].as_f64().expect("a number"), 1e-12, &what);
            }
        }
        for row in object["weighting_cells"].as_array().expect("rows") {
            let grouping = group("length", &network, row["gamma"].as_f64().expect("a number"));
            assert_eq!(grouping.groups.len() as u64, row["m"].as_u64().expect("a number"), "{name}");
        }
    }
}

#[test]
fn every_grouping_puts_each_spring_into_one_group_that_is_not_empty() {
    for name in ["square", "circle", "cube", "torus"] {
        let network = body(name).network();
        for rule in grouping::GROUPINGS {
            let found = group(rule.name, &network, 0.3);
            let mut count = vec![0; found.groups.len()];
            for &a in &found.group_of {
                count[a as usize] += 1;
            }
            let stated: Vec<usize> = found.groups.iter().map(|group| group.springs).collect();
            assert_eq!(count, stated, "{} on {name}", rule.name);
            assert!(count.iter().all(|&springs| springs > 0));
            let mut names: Vec<&str> = found.groups.iter().map(|group| group.name.as_str()).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), count.len(), "names are told apart");
        }
    }
    let cube = body("cube").network();
    let kinds: Vec<usize> = group("kind", &cube, 0.0).groups.iter().map(|group| group.springs).collect();
    assert_eq!(kinds, [540, 900, 500]);
    assert_eq!(group("direction", &cube, 0.0).groups.len(), 13);
    assert_eq!(group("each", &cube, 0.0).groups.len(), 1940);
    let plate = box_body(&[7, 7, 2], &[2.0, 2.0, 0.4]).network();
    assert_eq!(group("kind_and_length", &plate, 0.01).groups.len(), 5, "the rows of Table 4.2");
    assert!(group("length", &cube, 0.1) == group("length", &cube, 0.01));
    assert!(group("length", &cube, 0.1) != group("length", &cube, 0.5));
}

#[test]
fn direction_and_multiplicity_is_the_same_on_the_mirror_image() {
    let cube = body("cube").network();
    let found = group("direction_and_multiplicity", &cube, 0.0);
    // edges inside, on a face, on an edge of the cube (4, 2, 1 cells) for 3 directions; face diagonals in 2 or 1; body diagonals
    assert_eq!(found.groups.len(), 3 * 3 + 3 * 2 + 1);
    let number = |a: u32, b: u32| {
        let same = |s: &Spring| s.nodes == [a, b] || s.nodes == [b, a];
        found.group_of[cube.springs.iter().position(same).expect("the mirror image of a spring is one")]
    };
    let mirrored = |node: u32| 36 * (5 - node / 36) + node % 36;
    for (spring, &group) in cube.springs.iter().zip(&found.group_of) {
        let [a, b] = spring.nodes;
        assert_eq!(number(mirrored(a), mirrored(b)), group);
    }
}

#[test]
fn clusters_are_as_many_as_asked_for_and_the_same_again() {
    let torus = body("torus").network();
    let rule = grouping::find("k_means").expect("in the table").group;
    let spread = |grouping: &Grouping| -> f64 {
        let of = |(spring, &a): (&Spring, &u32)| (spring.length.ln() - grouping.groups[a as usize].length.ln()).powi(2);
        torus.springs.iter().zip(&grouping.group_of).map(of).sum()
    };
    let mut before = f64::INFINITY;
    for groups in [1, 8, 64] {
        let request = Request { groups, ..Request::default() };
        let found = rule(&torus, &request).expect("clusters");
        assert_eq!(found.groups.len(), groups);
        assert!(found.groups.is_sorted_by(|a, b| a.length <= b.length));
        assert_eq!(rule(&torus, &request).expect("clusters").group_of, found.group_of);
        assert!(spread(&found) < before, "more clusters are narrower");
        before = spread(&found);
    }
    // six springs of one cell, of which the diagonals have one middle: five different points
    let square = box_body(&[2, 2], &[1.0, 1.0]).network();
    assert_eq!(rule(&square, &Request { groups: 100, ..Request::default() }).expect("clusters").groups.len(), 5);
}

#[test]
fn the_second_ring_has_all_primitive_offsets_and_closes_over_a_merged_seam() {
    let second = topology::find("second_ring").expect("in the table").connect;
    let square = box_body(&[7, 6], &[1.0, 1.0]);
    let network = second(&square.grid, &square.points, &square.dofs);
    let further: Vec<&Spring> = network.springs.iter().filter(|spring| spring.kind == Kind::SecondRing).collect();
    // (1, 2), (1, -2): 6 x 4 places each; (2, 1), (2, -1): 5 x 5
    assert_eq!(further.len(), 2 * 24 + 2 * 25);
    assert_eq!(network.springs[..network.springs.len() - further.len()], square.network().springs);
    let cube = body("cube");
    let network = second(&cube.grid, &cube.points, &cube.dofs);
    let mut offsets: Vec<[i8; 3]> = network.springs.iter().map(|spring| spring.offset).collect();
    offsets.sort_unstable();
    offsets.dedup();
    assert_eq!(offsets.len(), 13 + 36);
    let factors = factors("inverse_square", &network);
    let [all, weights] = [&factors, &weighting::coefficients(&network, Weighting::Cells, &factors)];
    assert!(all.iter().zip(weights).all(|(p, w)| w >= p));
    // every node of the closed ring of 8 has as many second neighbours as any other on its circle
    let torus = torus(true);
    let network = second(&torus.grid, &torus.points, &torus.dofs);
    let mut degree = vec![0; torus.points.len()];
    for spring in network.springs.iter().filter(|spring| spring.kind == Kind::SecondRing) {
        spring.nodes.iter().for_each(|&node| degree[node as usize] += 1);
    }
    for place in 0..25 {
        let around: Vec<i32> = (0..8).map(|i| degree[25 * i + place]).collect();
        assert!(around.iter().all(|&springs| springs == around[0]), "place {place}: {around:?}");
    }
}

#[test]
fn a_gamma_outside_0_1_is_refused() {
    let network = body("square").network();
    for gamma in [0.0, 1.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = (grouping::find("length").expect("in the table").group)(&network, &Request::with_gamma(gamma))
            .expect_err("refused");
        assert_eq!(error.exit_status(), 2);
        assert!(error.to_string().contains(&gamma.to_string()), "{error}");
    }
}

#[test]
fn p5_spring_patch_test() {
    let (young, thickness, poisson) = (15e3, 0.7, 1.0 / 3.0_f64);
    let body = box_body(&[5, 5], &[2.0, 2.0]);
    let network = body.network();
    let k = 3.0 / 8.0 * young * thickness;
    let weights = weighting::coefficients(&network, Weighting::Cells, &factors("constant", &network));
    let c = young / (1.0 - poisson * poisson);
    for [xx, yy, xy] in [[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1e-3], [2e-3, -1e-3, 0.5e-3]] {
        let field = |x: [f64; 3]| [xx * x[0] + xy * x[1], xy * x[0] + yy * x[1]];
        let springs = network.springs.iter().zip(&weights).map(|(spring, w)| {
            let [a, b] = spring.nodes.map(|node| field(network.positions[node as usize]));
            let elongation = spring.direction[0] * (b[0] - a[0]) + spring.direction[1] * (b[1] - a[1]);
            k * w * elongation * elongation / 2.0
        });
        let density = c * (xx * xx + yy * yy + 2.0 * poisson * xx * yy) / 2.0 + c * (1.0 - poisson) * xy * xy;
        assert_near(springs.sum(), density * 4.0 * thickness, 1e-14, "energy");
    }
}

/// A body ready to be assembled.
struct Assembled {
    body: Body,
    network: Network,
    grouping: Grouping,
    weights: Vec<f64>,
    symbolic: std::sync::Arc<Symbolic>,
    stiffness: AffineStiffness,
}

fn assembled(body: Body, rule: &str, gamma: f64, profile: &str) -> Assembled {
    let network = body.network();
    let grouping = group(rule, &network, gamma);
    let weights = weighting::coefficients(&network, Weighting::Cells, &factors(profile, &network));
    let pattern = affine::pattern(&network, &body.dofs);
    let order = ordering::minimum_degree(&pattern).expect("a small pattern");
    let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
    let stiffness = AffineStiffness::new(&network, &grouping, &weights, &body.dofs, &symbolic);
    Assembled { body, network, grouping, weights, symbolic, stiffness }
}

fn bodies() -> Vec<Assembled> {
    vec![
        assembled(body("square"), "length", 0.1, "constant"),
        assembled(body("circle"), "length", 0.01, "axial_rigidity"),
        assembled(body("cube"), "direction", 0.1, "constant"),
        assembled(body("torus"), "length", 0.1, "constant"),
        assembled(torus(true), "length", 0.1, "axial_rigidity"),
        assembled(torus(true), "each", 0.1, "constant"),
    ]
}

fn numbers(m: usize) -> Vec<f64> {
    (0..m).map(|a| 100.0 + 5e3 * scattered(a)).collect()
}

/// sum_s phi_a w_s b_s b_s^T over all components of all nodes, then the free ones.
fn dense(case: &Assembled, phi: &[f64]) -> Vec<Vec<f64>> {
    let n = case.body.dofs.len();
    let mut matrix = vec![vec![0.0; n]; n];
    for (s, spring) in case.network.springs.iter().enumerate() {
        let k = phi[case.grouping.group_of[s] as usize] * case.weights[s];
        let mut b = Vec::new();
        for (node, sign) in spring.nodes.iter().zip([-1.0, 1.0]) {
            for (&dof, d) in case.body.dofs.free(*node as usize).iter().zip(spring.direction) {
                b.push((dof, sign * d));
            }
        }
        b.retain(|&(dof, _)| dof != FIXED);
        for &(i, x) in &b {
            for &(j, y) in &b {
                matrix[i as usize][j as usize] += k * x * y;
            }
        }
    }
    matrix
}

#[test]
fn assembled_stiffness_is_the_dense_sum_of_b_bt() {
    for case in bodies() {
        let phi = numbers(case.stiffness.groups());
        let expected = dense(&case, &phi);
        let largest = expected.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut values = vec![f64::NAN; case.symbolic.lower_rows().len()];
        case.stiffness.assemble_into(&phi, &mut values);
        let (starts, rows, order) = (case.symbolic.lower_starts(), case.symbolic.lower_rows(), case.symbolic.order());
        let mut stored = 0;
        for column in 0..order.len() {
            for entry in starts[column] as usize..starts[column + 1] as usize {
                let (i, j) = (order[rows[entry] as usize] as usize, order[column] as usize);
                assert!((values[entry] - expected[i][j]).abs() <= 1e-14 * largest, "entry ({i}, {j})");
                stored += if i == j { 1 } else { 2 };
            }
        }
        let present = expected.iter().flatten().filter(|&&x| x != 0.0).count();
        assert!(stored >= present, "no entry is missing");
    }
}

#[test]
fn products_and_diagonal_are_those_of_the_dense_sum() {
    for case in bodies() {
        let (n, m) = (case.stiffness.unknowns(), case.stiffness.groups());
        let phi = numbers(m);
        let expected = dense(&case, &phi);
        let u: Vec<f64> = (0..n).map(|i| scattered(i + 7) - 0.5).collect();
        let product: Vec<f64> = expected.iter().map(|row| row.iter().zip(&u).map(|(k, u)| k * u).sum()).collect();
        let largest = product.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let near = |found: &[f64]| found.iter().zip(&product).all(|(f, p)| (f - p).abs() <= 1e-13 * largest);
        let (mut out, mut sum, mut part) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        case.stiffness.apply_all(&phi, &u, &mut out);
        assert!(near(&out));
        for (a, phi) in phi.iter().enumerate() {
            case.stiffness.apply(a, &u, &mut part);
            sum.iter_mut().zip(&part).for_each(|(sum, part)| *sum += phi * part);
        }
        assert!(near(&sum));
        case.stiffness.diagonal(&phi, &mut out);
        assert!((0..n).all(|i| (out[i] - expected[i][i]).abs() <= 1e-14 * expected[i][i]));
    }
}

#[test]
fn an_updated_stiffness_has_the_bits_of_a_fresh_one() {
    for case in bodies() {
        let m = case.stiffness.groups();
        let (first, second) = (numbers(m), (0..m).map(|a| 3e3 * scattered(a + 99)).collect::<Vec<_>>());
        let mut updated = vec![0.0; case.symbolic.lower_rows().len()];
        case.stiffness.assemble_into(&first, &mut updated);
        case.stiffness.assemble_into(&second, &mut updated);
        let again = AffineStiffness::new(&case.network, &case.grouping, &case.weights, &case.body.dofs, &case.symbolic);
        let mut fresh = vec![f64::NAN; updated.len()];
        again.assemble_into(&second, &mut fresh);
        assert_eq!(updated, fresh);
    }
}

#[test]
fn r3_scaling_identity() {
    for case in bodies().into_iter().take(5) {
        let n = case.stiffness.unknowns();
        let phi = numbers(case.stiffness.groups());
        let load: Vec<f64> = (0..n).map(|i| scattered(i) - 0.5).collect();
        let mut factor = Factor::new(case.symbolic.clone());
        let mut solve = |scale: f64| {
            let phi: Vec<f64> = phi.iter().map(|phi| scale * phi).collect();
            case.stiffness.assemble_into(&phi, factor.values_mut());
            factor.refactor().expect("positive definite");
            let mut u = vec![0.0; n];
            factor.solve(&load, &mut u).expect("solvable");
            u
        };
        let (once, scaled) = (solve(1.0), solve(3.7));
        let largest = once.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let worst = once.iter().zip(&scaled).fold(0.0_f64, |m, (u, v)| m.max((u - 3.7 * v).abs()));
        assert!(worst <= 1e-13 * largest, "{}", worst / largest);
    }
}

#[test]
fn a_merged_seam_has_no_duplicate_springs_and_its_cells_add_up() {
    let (open, merged) = (torus(false).network(), torus(true).network());
    let mut pairs: Vec<[u32; 2]> =
        merged.springs.iter().map(|spring| spring.nodes).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    pairs.sort_unstable();
    pairs.dedup();
    assert_eq!(pairs.len(), merged.springs.len());
    assert_eq!(open.springs.len() - merged.springs.len(), 72, "the 40 edges and 32 diagonals of one 5 x 5 section");
    assert_eq!(merged.zero_length, 0);
    let cells = |network: &Network| network.springs.iter().map(|spring| spring.cells).sum::<u32>();
    assert_eq!(cells(&open), cells(&merged));
    assert_eq!(cells(&open), 8 * 4 * 4 * 28, "each of the cells has 28 springs");
    let dofs = torus(true).dofs;
    assert!(merged.springs.iter().all(|s| s.nodes.iter().all(|&node| dofs.master(node as usize) == node as usize)));
}

#[test]
fn coincident_nodes_have_no_spring_and_are_counted() {
    let mut points = box_body(&[3, 3], &[1.0, 1.0]).points;
    points[1] = points[0];
    let loose = Body::held(&[3, 3], points.clone(), 0, false).network();
    assert_eq!((loose.springs.len(), loose.zero_length), (19, 1));
    let tied = Body::held(&[3, 3], points, 0, true).network();
    assert_eq!((tied.springs.len(), tied.zero_length), (17, 0), "one node has no spring to itself");
    assert!(tied.springs.iter().all(|spring| spring.length.is_finite() && spring.length > 0.0));
}

#[test]
fn edges_alone_have_no_diagonals() {
    let body = box_body(&[4, 5, 3], &[1.0, 1.0, 1.0]);
    let edges = topology::find("edges").expect("in the table");
    let network = (edges.connect)(&body.grid, &body.points, &body.dofs);
    assert_eq!(network.springs.len(), 3 * 5 * 3 + 4 * 4 * 3 + 4 * 5 * 2);
    assert!(network.springs.iter().all(|spring| spring.kind == Kind::Edge));
}

#[test]
fn damping_4_18_of_experiment_4_i() {
    let network = box_body(&[9, 9], &[2.0, 2.0]).network();
    let diagonal = network.springs.iter().position(|spring| spring.kind == Kind::FaceDiagonal).expect("there is one");
    let stiffness = vec![400.0; network.springs.len()];
    let found = damping::coefficients(&network, &stiffness, &[2.0; 81], 20.0)[diagonal];
    assert!((found - 8.0 * 2.0_f64.sqrt()).abs() < 1e-12, "method section 9 says 11.31: {found}");
}
