//! Motion: steps around the limit, springs that fold up.

use springfit::clock::Progress;
use springfit::dynamics::collapse;
use springfit::dynamics::external::External;
use springfit::dynamics::integrator;
use springfit::dynamics::motion::{self, Schedule};
use springfit::dynamics::springs::{Coefficients, SpringModel};
use springfit::dynamics::stability::{self, Linearised};
use springfit::dynamics::stepper::{Settings, Stepper};
use springfit::geometry::dofs::DofMap;
use springfit::readable::significant;
use springfit::sparse::pattern::Pattern;
use springfit::springs::network::{Kind, Network, Spring};

use super::common::{SQUARE, run, runs, says, warned};

#[test]
fn time_step() {
    // one oscillator: the limit with lagged damping is (2 / omega) (sqrt(1 + zeta^2) - zeta)
    let omega = 50.0_f64;
    for zeta in [0.0, 1.0, 10.0] {
        let body = Linearised {
            pattern: Pattern::from_cliques(1, [[0_u32].as_slice()].into_iter()),
            stiffness: vec![omega * omega],
            damping: vec![2.0 * zeta * omega],
            masses: vec![1.0],
            symbolic: None,
        };
        let limit = stability::limit(&body).expect("a limit");
        let exact = 2.0 / omega * ((1.0 + zeta * zeta).sqrt() - zeta);
        assert!((limit.damped / exact - 1.0).abs() < 1e-9, "zeta {zeta}: {limit:?}, exact {exact}");
        assert!(
            body.is_stable(0.999 * exact).expect("an analysis") && !body.is_stable(1.001 * exact).expect("an analysis")
        );
    }
    // a scene: just below its limit it runs, just above it is refused by name
    let moving = |step: &str| {
        format!("{}[dynamics]\nstep = {step}\nsteps = 3\n", SQUARE.replace("young", "density = 1143.0\nyoung"))
    };
    let study = runs(&moving("\"auto\""));
    let limit = study.dynamics.expect("dynamics").limits[0].at_rest.expect("a limit");
    let safe = run(&moving(&format!("{:e}", 0.999 * limit.undamped))).expect("stable");
    assert!(safe.dynamics.expect("dynamics").motions[0].motion.frames.iter().flatten().all(|u| u.is_finite()));
    let error = run(&moving(&format!("{:e}", 1.001 * limit.undamped))).err().expect("unstable");
    let words = [
        format!("largest eigenfrequency {} rad/s", significant(limit.omega_max, 7)),
        format!("the limit is {:.6e} s", limit.undamped),
        "the fastest spring, between nodes".to_owned(),
    ];
    says(&error, 3, &words.each_ref().map(String::as_str));
}

#[test]
fn length_crosses_zero() {
    // two masses approach each other; the spring between them has no stiffness and gives no way to turn
    let spring = Spring {
        nodes: [0, 1],
        length: 1.0,
        direction: [1.0, 0.0, 0.0],
        kind: Kind::Edge,
        offset: [1, 0, 0],
        cells: 1,
    };
    let positions = vec![[0.0; 3], [1.0, 0.0, 0.0]];
    let network = Network { dimension: 2, positions, springs: vec![spring], zero_length: 0 };
    let dofs = DofMap::untied(2, &[[false; 3]; 2]);
    for (stiffness, damping) in [(0.0, 0.0), (4.0, 0.0), (4.0, 0.5)] {
        let (k, c) = ([stiffness], [damping]);
        let of = Coefficients { stiffness: &k, damping: Some(&c) };
        let mut model = SpringModel::new(&network, &dofs, of, &[1.0, 1.0]);
        let external = External { parts: Vec::new() };
        let leapfrog = integrator::find("leapfrog").expect("an integrator");
        // 16 steps of 1/16 s at 1 m/s: both meet exactly at 0.5 s without a spring
        let start = [&[0.0; 4][..], &[1.0, 0.0, -1.0, 0.0]].map(|v| v.iter().map(|x| x * 4.0).collect::<Vec<f64>>());
        let settings = Settings::with_step(0.0625);
        let mut stepper =
            Stepper::new(&mut model, &external, leapfrog, settings, [&start[0], &start[1]]).expect("a start");
        let found = motion::run(&mut stepper, Schedule { steps: 16, every: 1 }, &|_| 0.0, &Progress::default());
        let found = found.expect("finite forces all the way");
        assert!(found.frames.iter().flatten().all(|u| u.is_finite()));
        let event = collapse::find(&network, &dofs, &found.times, &found.frames).expect("it folds up");
        assert_eq!((event.springs, event.nodes), (1, [0, 1]));
        assert!(event.time > 0.0 && event.time <= 0.5, "{event:?}");
    }
    // a body that is crushed says so
    let crushed = SQUARE
        .replace("young", "density = 1143.0\nyoung")
        .replace("force_per_node = [2.0, -1.0]", "force_per_node = [0.0, -40000.0]")
        + "[dynamics]\nstep = \"auto\"\nsteps = 200\nframes = 200\ninitial = \"rest\"\n";
    let study = runs(&crushed);
    warned(&study.warnings, &["passed through zero length", "between nodes"]);
    let motion = &study.dynamics.expect("dynamics").motions[0].motion;
    assert!(motion.frames.iter().flatten().all(|u| u.is_finite()));
}
