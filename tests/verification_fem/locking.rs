//! What the table of methods says about locking, measured again on Cook's panel in plane strain and in space
//! ([`springfit::reference::methods::losses`] has the definition), and the words that are made of it.

use std::sync::OnceLock;

use springfit::geometry::dofs::DofMap;
use springfit::geometry::knots::KnotVector;
use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::geometry::patch::Patch;
use springfit::geometry::refine::refined;
use springfit::geometry::selection;
use springfit::reference::loads::{self, Face, Load};
use springfit::reference::locking::{self, Spans};
use springfit::reference::material::Plane;
use springfit::reference::methods::losses::{FELT, LOCKED, Loss, Losses, POISSON};
use springfit::reference::methods::{self, METHODS, Method, MethodBody, nurbs};
use springfit::reference::points::IntegrationPoints;

use crate::problem::{lame, mapped, points, solve, supports, traction};

/// Cells a direction of the methods that are measured, and of the B-bar that stands for the truth, in the plane and in space.
const CELLS: usize = 4;
const TRUE_CELLS: [usize; 2] = [24, 8];

/// nu = 0.3 and all of the table.
const RATIOS: usize = POISSON.len() + 1;

/// A method on one kind of cells, or one degree of a patch.
struct Measured {
    method: &'static Method,
    kind: Option<CellKind>,
    degree: usize,
    dimension: usize,
    told: Loss,
    found: Loss,
}

/// The panel from the unit square or cube.
fn place([x, y, z]: [f64; 3]) -> [f64; 3] {
    [48.0 * x, (1.0 - y) * 44.0 * x + y * (44.0 + 16.0 * x), 44.0 * z]
}

fn panel(cells: usize, kind: CellKind) -> Mesh {
    mapped(&vec![cells; kind.dimension()], kind, &place)
}

/// The panel as a patch with [`CELLS`] spans a direction.
fn patch(dimension: usize, degree: usize) -> Patch {
    let knots = vec![KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0]).expect("knots"); dimension];
    let corner = |c: usize| [0, 1, 2].map(|a| if a < dimension { (c >> (dimension - 1 - a) & 1) as f64 } else { 0.0 });
    let corners = (0..1 << dimension).map(corner).map(place).collect();
    let linear = Patch::new(knots, corners, vec![1.0; 1 << dimension]).expect("a patch");
    refined(&linear, degree - 1, CELLS.ilog2() as usize).expect("a finer patch")
}

/// f.u for nu = 0.3 and all of [`POISSON`].
fn answers(points: &IntegrationPoints, dofs: &DofMap, load: &Load) -> [f64; RATIOS] {
    let still = vec![[0.0; 3]; dofs.nodes()];
    std::array::from_fn(|i| {
        let poisson = if i == 0 { 0.3 } else { POISSON[i - 1] };
        let u = solve(points, lame(1.0, poisson, dofs.dimension(), Plane::Strain), dofs, &load.forces, &still);
        let of = |(dof, force): (usize, &f64)| u[dofs.owner(dof).0][dofs.owner(dof).1] * force;
        load.forces.iter().enumerate().map(of).sum()
    })
}

fn of_mesh(method: &str, mesh: &Mesh) -> [f64; RATIOS] {
    let dofs = supports(mesh, &|x| [x[0] == 0.0; 3]);
    let load = traction(mesh, &dofs, &|x| x[0] == 48.0, &|_, _| [0.0, 1.0, 0.0]);
    answers(&points(method, mesh), &dofs, &load)
}

fn of_patch(patch: &Patch) -> [f64; RATIOS] {
    let mut fixed = vec![[false; 3]; patch.points().len()];
    let held = selection::face_nodes(&patch.grid(), "x-").expect("a face");
    held.iter().for_each(|&node| fixed[node as usize] = [true; 3]);
    let dofs = DofMap::untied(patch.dimension(), &fixed);
    let face = Face { patch, name: "x+", thickness: 1.0, extra_points: 0 };
    let load = loads::traction(face, &dofs, &|_, _| [0.0, 1.0, 0.0]).expect("a load");
    answers(&nurbs::integration_points(patch, 0, 1.0), &dofs, &load)
}

/// Everything that the table tells, measured once.
fn measured() -> &'static [Measured] {
    static ALL: OnceLock<Vec<Measured>> = OnceLock::new();
    ALL.get_or_init(|| {
        let truth = [("q4_bbar", CellKind::Quadrilateral), ("b8_bbar", CellKind::Hexahedron)]
            .map(|(name, kind)| of_mesh(name, &panel(TRUE_CELLS[kind.dimension() - 2], kind)));
        let loss = |dimension: usize, found: [f64; RATIOS]| -> Loss {
            let share = |i: usize| found[i] / truth[dimension - 2][i];
            std::array::from_fn(|i| 100.0 * (1.0 - share(i + 1) / share(0)))
        };
        let mut all = Vec::new();
        for method in METHODS {
            match (method.body, method.losses) {
                (MethodBody::Mesh { cells, .. }, Losses::Cells(losses)) => {
                    assert_eq!(cells.len(), losses.len(), "{}", method.name);
                    for (&kind, &told) in cells.iter().zip(losses) {
                        let (dimension, mesh) = (kind.dimension(), panel(CELLS, kind));
                        let found = loss(dimension, of_mesh(method.name, &mesh));
                        all.push(Measured { method, kind: Some(kind), degree: 1, dimension, told, found });
                    }
                }
                (MethodBody::Patch(_), Losses::Degrees(losses)) => {
                    for (dimension, losses) in (2..).zip(losses) {
                        for (degree, &told) in (1..).zip(losses) {
                            let found = loss(dimension, of_patch(&patch(dimension, degree)));
                            all.push(Measured { method, kind: None, degree, dimension, told, found });
                        }
                    }
                }
                _ => panic!("{} has the losses of another kind of body", method.name),
            }
        }
        all
    })
}

impl Measured {
    fn name(&self) -> String {
        format!("{} {:?} degree {} in {} dimensions", self.method.name, self.kind, self.degree, self.dimension)
    }

    fn locks(&self) -> bool {
        self.found[POISSON.len() - 1] > LOCKED
    }

    /// The warning about it.
    fn warning(&self, poisson: f64) -> Option<String> {
        match self.kind {
            Some(kind) => locking::warning(self.method, Spans::Cells(&panel(1, kind)), poisson),
            None => locking::warning(self.method, Spans::Patch(&patch(self.dimension, self.degree)), poisson),
        }
    }
}

/// The figures of the table have one digit behind the point.
#[test]
fn losses_of_the_table_are_those_of_cook_s_panel() {
    for case in measured() {
        println!("{:60} {}", case.name(), case.found.map(|loss| format!("{loss:.1}")).join(", "));
    }
    for case in measured() {
        let apart = (0..POISSON.len()).map(|i| (case.found[i] - case.told[i]).abs()).fold(0.0, f64::max);
        assert!(apart < 0.051, "{}: measured {:.2?}, told {:?}", case.name(), case.found, case.told);
    }
}

/// Warned is exactly where a method that locks loses more than it may, with the number measured; what is recommended does
/// not lock.
#[test]
fn warnings_say_what_was_measured() {
    let (mut locked, mut free) = (0, 0);
    for case in measured() {
        assert_eq!(case.warning(0.3), None, "{}", case.name());
        for (i, &poisson) in POISSON.iter().enumerate() {
            let Some(word) = case.warning(poisson) else {
                let felt = case.found[..=i].iter().any(|&loss| loss > FELT);
                assert!(!(felt && case.locks()), "{}: no word at {poisson}", case.name());
                free += 1;
                continue;
            };
            locked += 1;
            assert!(case.locks(), "{word}");
            let first = POISSON[case.found.iter().position(|&loss| loss > FELT).expect("it is felt")];
            let number = format!("{:.0} % too little at nu = {poisson}", case.told[i]);
            for part in [&format!("\"{}\"", case.method.name), &format!("locks from nu = {first} on"), &number] {
                assert!(word.contains(part.as_str()), "{part:?} is not in {word}");
            }
            let (_, remedy) = word.rsplit_once(';').expect("a remedy");
            for other in measured().iter().filter(|other| recommended(case, other, remedy)) {
                assert!(!other.locks(), "{} is recommended in {word}", other.name());
            }
        }
    }
    assert!(locked > 40 && free > 40, "{locked} {free}");
}

/// Whether the remedy names a method, on the same cells or with its own, or a degree.
fn recommended(case: &Measured, other: &Measured, remedy: &str) -> bool {
    let name = format!("\"{}\"", other.method.name);
    let same_body = other.dimension == case.dimension && other.kind == case.kind;
    match other.kind {
        None => same_body && remedy.contains(&format!("degree {} ", other.degree)),
        Some(_) if remedy.contains("on the same mesh these") => same_body && remedy.contains(&name),
        Some(kind) => remedy.contains(&format!("{name} on {}", &format!("{kind:?}").to_lowercase()[..8])),
    }
}

/// A method against locking is none on cells that have constant gradients anyway.
#[test]
fn b_bar_on_tetrahedra_is_told_to_lock() {
    let bbar = methods::find("b8_bbar").expect("in the table");
    let [hexahedra, tetrahedra] = [CellKind::Hexahedron, CellKind::Tetrahedron].map(|kind| panel(1, kind));
    assert_eq!(locking::warning(bbar, Spans::Cells(&hexahedra), 0.4999), None);
    let mut mixed = hexahedra.clone();
    mixed.push(CellKind::Tetrahedron, tetrahedra.corners(0));
    for mesh in [&tetrahedra, &mixed] {
        let word = locking::warning(bbar, Spans::Cells(mesh), 0.4999).expect("a word");
        assert!(word.contains("\"b8_bbar\" on tetrahedra locks"), "{word}");
    }
}
